"""The radio between drone and ground, emulated: what it carries depends on where the drone is."""
