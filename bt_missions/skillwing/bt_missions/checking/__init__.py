"""Checks of a mission before its run: fit with the robot, branches that are reached, way to the rescue goal."""
