"""Links between nodes of one program, for tests and simulation."""

from fsmkit.carriers.in_process.plugin import InProcessLink, Wire

__all__ = ["InProcessLink", "Wire"]
