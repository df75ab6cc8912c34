"""Live video: encoded on board as the link allows, decoded and measured on the ground."""
