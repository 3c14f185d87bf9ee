"""The search in C: binds generated machines to ``verify/core``, compiles that once, runs it."""
