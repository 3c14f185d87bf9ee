"""Verbs for verification."""
