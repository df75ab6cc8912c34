"""Which situations can come about in a skillset: states of its resources, at each step of its skills."""
