"""Command group `skillwing mission`, and the file of a new mission."""
