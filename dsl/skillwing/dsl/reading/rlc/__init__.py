"""Compositions of skills in the notation of ONERA's `.rlc` files."""
