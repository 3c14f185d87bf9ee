"""Rewritings: functions that express a rule of another tool by the rules of charts.

Each takes a Document whose transitions follow the rule of the tool, and returns one that does the
same as a chart. It records what it changed. The names R1 to R12 are those of the reports.
"""
