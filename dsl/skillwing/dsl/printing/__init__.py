"""Printing: sources in one style, models as source, pictures and reference pages of skillsets."""
