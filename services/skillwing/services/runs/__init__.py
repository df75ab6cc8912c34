"""Runs in a folder: what they hold, and which are deleted."""
