"""The search in C: bind generated machines to ``verify/core``, compile once, run."""
