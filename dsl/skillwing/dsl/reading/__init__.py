"""Reading of source text: from characters to syntax nodes, with recovery from syntax errors."""
