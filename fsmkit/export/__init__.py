"""Export systems: a ClosedSystem in, a model in the notation of another tool out.

Features of a system that a notation does not support are findings, never omitted silently.
"""
