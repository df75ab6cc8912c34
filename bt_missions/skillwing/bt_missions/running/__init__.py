"""Flying a mission: what one is, where it is found, its options, its process and flight, orders, the tree in words."""
