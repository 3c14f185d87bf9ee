"""The passes of `elaborate`, one verb per file: each takes a Document further towards a Chart."""
