"""The commands that talk to a running system, and those that start and stop one. One file per command."""
