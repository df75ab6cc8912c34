"""Missions to begin with."""
