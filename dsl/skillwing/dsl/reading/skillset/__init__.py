"""The dialect of `.skillset` files."""
