"""What a flight leaves behind, and the judge of it."""
