"""Parts of one flight: its plan, its session on a network, and the observer of the ground truth."""
