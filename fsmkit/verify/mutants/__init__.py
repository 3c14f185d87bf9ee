"""Mutation analysis: charts with one seeded mistake each, and whether a property finds it.

In: a system whose properties hold. Out: for each mutant, the properties that it breaks, or why none
can, or a run in which it differs from the original. A mutant is a Document with one change, so it
is elaborated, generated and explored as any chart is.
"""
