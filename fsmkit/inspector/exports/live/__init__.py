"""An exporter of messages."""
