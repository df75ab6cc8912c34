"""Definition of a mission: trees, options, source files and the problems found in them."""
