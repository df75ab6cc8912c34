"""Finding out what is wrong with a system: what is seen, what that means, and what to do about it."""
