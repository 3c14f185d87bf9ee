"""Charts, plans and systems in; trees for a terminal, or data for JSON, out."""
