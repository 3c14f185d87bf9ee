"""Tools for AI assistants, by the Model Context Protocol: charts are read, edited and checked."""
