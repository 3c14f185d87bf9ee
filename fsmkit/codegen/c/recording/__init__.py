"""What is kept of a machine in C: saved states, traces and logs, as the bytes of `plan.image`."""
