"""Wires of a board: `board_a.io.yaml` declares them, and their meaning to its machines."""
