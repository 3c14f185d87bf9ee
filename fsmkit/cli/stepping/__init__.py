"""What ``fsmkit run`` does, line by line."""
