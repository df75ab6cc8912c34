"""Flights of two drones in one world: their plans, results and judgement."""
