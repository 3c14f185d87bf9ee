"""Engines: a ClosedSystem in, an Exploration out; the same from each, state by state."""
