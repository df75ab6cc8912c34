"""Recorded steps of a resource manager, and their replay."""
