"""Subtrees, composites and decorators that missions are built from."""
