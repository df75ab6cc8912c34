"""Leaves of behaviour trees: skills, conditions, and what they know of the robot."""
