"""Machines written by hand: the limits to which generated machines are compared."""
