"""Journal of the resource manager: its memory in an SQLite file that outlives the process."""
