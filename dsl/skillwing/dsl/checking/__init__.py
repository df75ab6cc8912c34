"""From syntax nodes to a checked model: names, types, and what can never hold."""
