"""The bridge: the only translator between functional layer and skillset."""
