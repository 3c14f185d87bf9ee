"""Machines of XState 5, read from JSON and from programs that are never run."""
