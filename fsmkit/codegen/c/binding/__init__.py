"""Bindings to existing C: the bound part of the header, and the source that joins both."""
