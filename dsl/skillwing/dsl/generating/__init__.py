"""From a checked model to Python."""
