"""Requirements: files of other tools, read; and the matrix from requirements to evidence."""
