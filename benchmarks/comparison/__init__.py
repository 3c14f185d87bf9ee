"""The yardstick: compare generated machines with machines written by hand for the same work.

Run ``python -m benchmarks.comparison``; ``docs/reference/benchmarks.md`` describes the figures.
"""
