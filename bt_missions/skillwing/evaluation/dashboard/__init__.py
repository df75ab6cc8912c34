"""The robot's part of the Rerun dashboard."""
