"""Sensors: measurements, rates and delays, faults, and self-diagnosis."""
