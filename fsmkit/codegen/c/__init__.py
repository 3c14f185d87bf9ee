"""C as a target: a table of contents in `generate`, one module for each kind of section."""
