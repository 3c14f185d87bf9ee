"""Transition systems for Graphviz."""
