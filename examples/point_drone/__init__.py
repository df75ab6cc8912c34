"""A vehicle that is not the simulator, under the M600's skills: see docs/functional-layer.md."""
