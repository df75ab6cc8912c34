"""Commands of the skill managers to nodes on board: the authority to give them, and the service that answers."""
