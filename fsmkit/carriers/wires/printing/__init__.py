"""The C of a board's wires: from raw images to machines, and back."""
