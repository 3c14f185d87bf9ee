"""What a check may use: seconds in, an end in time out. No child outlives its parent."""
