"""The yardstick: what generated machines cost beside machines written by hand for the same work.

Run it as ``python -m benchmarks.comparison``; ``docs/reference/benchmarks.md`` says what is
counted.
"""
