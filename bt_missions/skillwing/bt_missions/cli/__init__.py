"""Command group `skillwing mission`, and mission templates."""
