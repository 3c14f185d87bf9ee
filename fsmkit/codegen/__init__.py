"""What writes machines: one folder a target, none of which imports another."""
