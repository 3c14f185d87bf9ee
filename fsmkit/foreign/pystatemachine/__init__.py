"""Machines of the library python-statemachine 3, read from Python objects into charts."""
