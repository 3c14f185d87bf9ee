"""What runs: the reference interpreter, sessions and clocks, and what ships with machines."""
