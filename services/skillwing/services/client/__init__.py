"""Clients of the managers: for missions, commands, scripts and tests."""
