"""The Production Cell simulated: its plant, what surrounds it, and who keeps them in step.

`plant` is a process of its own, the boards are others; `orchestrator` steps them all, a millisecond
at a time, over ZeroMQ. ``python -m machines.production_cell.simulation`` runs them.
"""
