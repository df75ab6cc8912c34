"""Many flights of one mission, each of another seed, and what became of them."""
