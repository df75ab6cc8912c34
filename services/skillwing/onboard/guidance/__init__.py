"""Guidance: motions of goals as setpoints for the autopilot, inside the fence and short of obstacles."""
