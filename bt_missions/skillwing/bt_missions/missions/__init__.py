"""Installed missions, each in Python and as a tree file."""
