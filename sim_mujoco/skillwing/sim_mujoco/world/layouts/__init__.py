"""Layouts, one module for each kind of world: pure geometry drawn from a seed."""
