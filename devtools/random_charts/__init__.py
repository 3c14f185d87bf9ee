"""Random charts: decisions in (`choices`), Documents, systems and scripts out.

Whatever is decided, a chart is valid by construction and its runs end.
"""
