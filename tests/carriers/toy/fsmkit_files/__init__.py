"""Frames between nodes in files: a carrier that is one folder."""
