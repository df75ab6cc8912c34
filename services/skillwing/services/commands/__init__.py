"""The commands of a running system, one file each: its name is the name of the command."""
