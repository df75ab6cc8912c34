"""`skillwing demo`: a whole flight with one command."""
