"""Analyses: from a Chart, derive facts that hold in all its runs.

Each is a pure function of a Chart. What it claims is on the safe side: it may miss, it never errs.
"""
