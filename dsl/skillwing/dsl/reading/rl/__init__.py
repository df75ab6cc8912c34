"""The dialect of ONERA's `.rl` files."""
