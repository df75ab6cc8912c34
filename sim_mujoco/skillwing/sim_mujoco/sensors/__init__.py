"""Sensors: what they measure, how often and how late, how they fail, and how they notice it themselves."""
