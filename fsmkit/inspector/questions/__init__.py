"""Queries of a client: values, reasons, effects of an event, and searches.

All are pure functions of moments and charts.
"""
