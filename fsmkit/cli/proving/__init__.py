"""Verbs that prove what charts do."""
