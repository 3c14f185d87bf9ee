"""A target for awk, as a package outside of fsmkit would have it (docs/how-to/add-a-target.md)."""
