"""The terminal: what the commands share, and the command line that calls them."""
