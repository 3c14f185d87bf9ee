"""Reports: an Exploration in, verdicts, counterexamples and their pictures out.

A path is shown only after the interpreter has performed it.
"""
