"""Engines: a ClosedSystem in, an Exploration out; all engines agree, state by state."""
