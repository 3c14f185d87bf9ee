"""Analyses: a Chart in, what holds of all its runs out.

Each is a pure function of a Chart. What it claims is on the safe side: it may miss, it never errs.
"""
