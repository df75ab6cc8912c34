"""Pictures of a skillset: what they show (`diagram`, `subjects`), how they are written (`dot`, `mermaid`, `svg`)."""
