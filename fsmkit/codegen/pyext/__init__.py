"""Charts as extension modules of CPython: the generated C, with the class of the Python target."""
