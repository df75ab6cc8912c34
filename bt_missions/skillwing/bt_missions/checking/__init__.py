"""Checks of a mission before its flight: does it fit the robot, can every branch run, does the drone land."""
