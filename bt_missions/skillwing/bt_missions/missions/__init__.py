"""Installed missions, those of a drone: each in Python and as a tree file."""
