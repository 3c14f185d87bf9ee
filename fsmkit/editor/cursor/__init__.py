"""Find the slot of a cursor, and its permitted contents, in YAML or SCXML that may not parse."""
