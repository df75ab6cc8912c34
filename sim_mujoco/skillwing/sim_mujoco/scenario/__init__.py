"""Scenario files: their format, how they are read, and which faults they may name."""
