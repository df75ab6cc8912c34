"""The manager processes: shells around the cores, the hooks of skill developers, and mocks."""
