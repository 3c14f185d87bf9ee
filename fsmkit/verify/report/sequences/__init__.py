"""Sequence diagrams: steps of machines, and the messages between them."""
