"""Certificates: interpreter, C and binaries of other processors agree in every step."""
