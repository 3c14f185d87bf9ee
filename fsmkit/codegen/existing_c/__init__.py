"""Files that bind a chart to existing C: what its names are in the host's headers.

A chart stays neutral: only the target ``c`` reads the binding beside it (``charger.c.yaml``).
"""
