"""Missions as behaviour trees that see the robot only through its skillset interface."""
