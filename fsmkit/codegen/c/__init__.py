"""C as a target: a Plan in, a header and sources out.

`generate` is the table of contents. Nothing allocates; no behaviour is undefined.
"""
