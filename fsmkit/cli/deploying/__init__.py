"""Verbs for nodes and boards."""
