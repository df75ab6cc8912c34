"""Measurements of sensors as arrays: scans, depth pictures, and the directions of their rays."""
