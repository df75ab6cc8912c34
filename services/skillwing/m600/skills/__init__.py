"""The skill managers, one file per skill, and what they share."""
