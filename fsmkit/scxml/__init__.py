"""The SCXML notation: reader and writer."""
