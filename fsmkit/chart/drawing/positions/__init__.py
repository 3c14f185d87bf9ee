"""Drawings that keep their positions while the chart is edited."""
