"""Judges of a finished flight, who alone know the true world."""
