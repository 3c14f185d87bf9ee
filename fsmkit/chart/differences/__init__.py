"""Differences between two charts, by meaning: not by lines of text."""
