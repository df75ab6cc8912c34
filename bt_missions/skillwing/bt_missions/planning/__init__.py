"""Where to fly next: routes, and ways round what stands on them."""
