"""Copies of used charts: elaborated alone, then put below the states that they fill.

What is typed is copied; no text of a used chart is read twice or rewritten.
"""
