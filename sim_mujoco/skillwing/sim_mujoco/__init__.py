"""The functional layer in simulation: MuJoCo physics, ray-cast sensors, autopilot and guidance."""
