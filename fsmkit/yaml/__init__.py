"""The YAML notation: reader and writer."""
