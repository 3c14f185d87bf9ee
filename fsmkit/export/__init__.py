"""Exports: a ClosedSystem in, a model in the notation of another tool out.

What a notation cannot say of a system is a finding, never left out in silence.
"""
