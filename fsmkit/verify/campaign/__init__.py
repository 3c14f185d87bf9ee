"""Campaigns: many checks, mutants, searches with seeds and comparisons, on as many processors.

In: a file of runs. Each run becomes jobs, which are data; workers, of this machine or of a cluster,
perform them; what came of each is kept as soon as it is known.
"""
