"""The simulated radio link between drone and ground; its capacity depends on the drone's position."""
