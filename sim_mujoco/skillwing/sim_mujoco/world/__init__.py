"""Worlds made from a seed: what stands where, as a physics scene and as triangles."""
