"""From source text to syntax nodes, across syntax errors."""
