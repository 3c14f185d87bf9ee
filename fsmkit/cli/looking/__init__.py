"""Verbs that show and run charts."""
