"""State spaces: a System in, states and their successors by the reference interpreter out.

`closed_system` defines what a state and a step are, once for both engines.
"""
