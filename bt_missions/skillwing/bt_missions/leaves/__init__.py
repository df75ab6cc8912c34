"""Leaves of behaviour trees: skills, conditions and branch switches, and the context that they share."""
