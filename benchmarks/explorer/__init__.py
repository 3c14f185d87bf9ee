"""Compare the explorer with SPIN: the same closed systems, the same number of states."""
