"""Generation of Python and Compose files from a checked model."""
