"""Wires of a board: `board_a.io.yaml` says what they are, and what they mean to its machines."""
