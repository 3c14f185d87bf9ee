"""Explored systems in the notations of other tools."""
