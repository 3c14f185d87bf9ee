"""Machines written by hand: the limits to which generated machines are compared.

In Python they assign ``data.n = data.n + 1``, which CPython 3.11 executes faster than ``+=``.
"""
