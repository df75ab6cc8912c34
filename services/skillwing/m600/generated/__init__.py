# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Code of the skillset `m600`: `types`, `managers` and `interface`."""

SCHEMA_HASH = "d0ddfaf503763a55"
