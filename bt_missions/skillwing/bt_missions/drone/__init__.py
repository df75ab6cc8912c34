"""Subtrees for missions of a drone: take-off, flight with a depth map, landing and rescue.

`templates/` has the first mission that `skillwing mission new` writes for the m600.
"""
