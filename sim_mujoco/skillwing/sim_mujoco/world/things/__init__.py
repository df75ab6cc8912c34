"""What stands in a world: each thing as outline, height and solid shapes."""
