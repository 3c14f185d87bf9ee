"""Machines that are small: what is the same for all states and transitions is there once."""
