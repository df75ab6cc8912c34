"""Pictures of a skillset: their content (`diagram`, `subjects`) and their formats (`dot`, `mermaid`, `svg`)."""
