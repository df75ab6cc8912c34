"""Reachable situations of a skillset: the states of its resources at each step of its skills."""
