"""The simulated vehicle and its world: MuJoCo physics, ray-cast sensors, autopilot, navigation and radio link."""
