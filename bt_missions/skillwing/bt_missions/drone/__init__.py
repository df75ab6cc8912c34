"""Subtrees for missions of a drone: take-off, flight with a depth map, landing and rescue."""
