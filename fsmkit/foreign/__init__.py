"""Machines of other tools as charts: readers, and what they share."""
