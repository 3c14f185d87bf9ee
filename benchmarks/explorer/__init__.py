"""The explorer beside SPIN: the same closed systems, the same number of states."""
