"""The drone in simulation: airframe, physics, autopilot, and the process around them."""
