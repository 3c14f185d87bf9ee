"""Graphviz, which lays out drawings: the program of this machine, or the bundled WebAssembly."""
