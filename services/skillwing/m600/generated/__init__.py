# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Made from the skillset `m600`, and never edited."""

SCHEMA_HASH = "5e6062ce50274f2c"
