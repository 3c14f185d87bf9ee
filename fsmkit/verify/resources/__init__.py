"""The time limit and the child processes of a check. No child outlives its parent."""
