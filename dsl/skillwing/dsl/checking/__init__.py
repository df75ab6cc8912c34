"""The checker: from syntax nodes to a model whose names, types and guards are valid."""
