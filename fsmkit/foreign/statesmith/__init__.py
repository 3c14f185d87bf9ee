"""Diagrams of StateSmith: PlantUML, draw.io and yEd."""
