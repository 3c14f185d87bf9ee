"""Drawings in the language of PlantUML."""
