"""Pieces that trees are built from."""
