"""Syntax error recovery, so that one run finds every syntax problem of a file."""
