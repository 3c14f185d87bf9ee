"""A carrier of traces."""
