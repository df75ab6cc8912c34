"""Worlds made from a seed, as a physics scene and as triangles."""
