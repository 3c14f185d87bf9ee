"""What proves: a System in, a Report out: verdicts, each with its counterexample.

What is said holds of the generated C that ships, up to what the report says it assumes.
"""
