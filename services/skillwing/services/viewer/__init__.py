"""The Rerun viewer: its program on this machine, and its page for browsers."""
