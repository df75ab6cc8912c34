"""Every step of a resource manager, written down with its answer, and asked once more of the core as it is now."""
