"""Functions of a chart, and the local variables of their bodies and of handlers."""
