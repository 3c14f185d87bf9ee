"""Where a cursor stands in YAML or SCXML that need not parse, and what may be written there."""
