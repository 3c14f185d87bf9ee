"""What each part of a generated machine costs where it is used, and that it is free elsewhere.

``python -m benchmarks.overhead`` prints the table of ``docs/reference/benchmarks.md``.
"""
