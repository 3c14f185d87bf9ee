"""Statecharts of IBM Rhapsody: units in the text format of its archives."""
