"""Many flights of one mission, each of another seed, and their results."""
