"""The recorder process, and what it writes of a run: timeline, goals and a Rerun recording."""
