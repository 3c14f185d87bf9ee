"""Verbs that generate code."""
