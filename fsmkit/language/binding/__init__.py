"""Binding: look up names, and give every node of an expression its type and location."""
