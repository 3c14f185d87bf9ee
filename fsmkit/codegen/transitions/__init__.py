"""A chart as a configuration of the library `transitions`, where that has the same meaning."""
