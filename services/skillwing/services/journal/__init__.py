"""The journal: what the resource manager must not forget, in an SQLite file that outlives its process."""
