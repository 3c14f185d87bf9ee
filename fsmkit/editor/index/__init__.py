"""The index: files, the symbols they declare, and all uses of each symbol."""
