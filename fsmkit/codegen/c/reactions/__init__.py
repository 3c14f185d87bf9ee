"""What a machine in C does on an event: selection, exit sets, entry sets, the loop around them."""
