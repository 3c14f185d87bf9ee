"""Functions of a chart, and the local variables of function bodies and handlers."""
