"""Drawings in the language of Graphviz."""
