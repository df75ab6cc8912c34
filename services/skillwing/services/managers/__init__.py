"""The manager processes: shells around the cores, and the hooks of skill developers."""
