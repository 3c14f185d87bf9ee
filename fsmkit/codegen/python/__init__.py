"""The Python target: one module a machine, on the standard library alone."""
