"""Verbs that write charts."""
