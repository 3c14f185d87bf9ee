"""State diagrams of Mermaid."""
