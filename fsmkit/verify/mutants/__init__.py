"""Mutation analysis: change charts in one location each, and check whether a property detects it.

The input is a system whose properties hold. The output is, for each mutant, the properties that it
violates, or why none can, or a run in which it differs from the original. A mutant is a Document
with one change, so it is elaborated, generated and explored like any chart.
"""
