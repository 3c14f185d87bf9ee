"""fsmkit: statecharts compiled to C and Python, explored exhaustively, from one source."""

__version__ = "0.1.0"
