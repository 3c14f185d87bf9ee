"""Hours of simulated time under random events and faults, with an account of each event."""
