"""Verify systems: a System in, a Report out, with verdicts and their counterexamples.

Verdicts hold for the generated C that ships, under the assumptions that the report lists.
"""
