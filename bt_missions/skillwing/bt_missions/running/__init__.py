"""Flying a mission: its definition, the check before it, the process, the abort, the tree in words."""
