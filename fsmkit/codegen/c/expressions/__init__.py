"""Expressions and executable content in C, with exactly the meaning of the typed tree."""
