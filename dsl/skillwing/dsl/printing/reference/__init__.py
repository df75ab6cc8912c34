"""The reference page of a skillset, in Markdown."""
