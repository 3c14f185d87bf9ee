"""Charts, plans and systems as trees on the terminal, and as data for JSON."""
