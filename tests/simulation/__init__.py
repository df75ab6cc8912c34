"""Deterministic simulation: the real managers and clients in one process, in virtual time, on a network that fails.

One seed is one run. `make simulate` runs many, `make simulate SEED=4711` tells the story of one.
"""
