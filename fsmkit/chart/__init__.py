"""Charts: Documents in, a Chart out (`elaborate`).

From here on inheritance is resolved, names are bound, types known; a Chart is frozen.
"""
