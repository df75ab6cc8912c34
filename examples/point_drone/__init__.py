"""A vehicle other than the simulator, under the M600's skills (docs/functional-layer.md)."""
