"""Live video: encoded on board as the link allows, decoded and judged on the ground."""
