"""Measure the cost of each part of a generated machine, and that unused parts are free.

``python -m benchmarks.overhead`` prints the table of ``docs/reference/benchmarks.md``.
"""
