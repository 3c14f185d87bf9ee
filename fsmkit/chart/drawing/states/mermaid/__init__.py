"""Drawings in the language of Mermaid."""
