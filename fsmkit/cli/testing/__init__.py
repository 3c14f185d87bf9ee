"""Verbs that test charts."""
