"""Generators: each folder turns a Plan into the files of one target."""
