"""The simulated drone: physics, autopilot and sensors together, and their process."""
