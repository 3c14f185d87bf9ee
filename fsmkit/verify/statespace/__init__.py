"""State spaces: states of a System and their successors, by the reference interpreter.

`closed_system` defines states and steps, once for both engines.
"""
