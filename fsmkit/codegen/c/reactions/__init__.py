"""The reactions of a machine in C: selection, exit sets, entry sets, and the loop around them."""
