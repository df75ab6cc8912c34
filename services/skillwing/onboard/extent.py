"""How much room the drone takes: for those that keep it clear of things, and for those that judge whether they did."""

from __future__ import annotations

from typing import Final

TIP_RADIUS: Final = 0.84
"""Radius of a sphere around the centre that holds all of the drone, its blades to their tips [m]."""
