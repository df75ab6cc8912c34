"""The language's commands, one file each. Exit codes: see `source.py`."""
