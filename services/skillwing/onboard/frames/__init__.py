"""Vectors, poses and motion in ENU and FLU."""
