"""Campaigns: many checks, mutants, seeded searches and comparisons, on several processors.

A campaign file lists runs. Each run becomes jobs, which are plain data. Workers of this machine or
of a cluster perform them, and each outcome is stored as soon as it is known.
"""
