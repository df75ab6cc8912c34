"""Scenario files: format, reading, and checks."""
