"""Bindings of a chart to existing C: the names of the chart in the host's headers.

A chart stays neutral: only the target ``c`` reads the binding beside it (``charger.c.yaml``).
"""
