"""Reports: an Exploration in, verdicts, counterexamples and their pictures out.

The interpreter performs each path before it is shown.
"""
