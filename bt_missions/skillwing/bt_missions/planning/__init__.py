"""Route planning: the next leg of a route, and detours round obstacles."""
