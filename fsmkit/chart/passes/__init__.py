"""What `elaborate` does, one verb a file: each takes a Document further towards a Chart."""
