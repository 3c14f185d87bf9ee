"""The Production Cell seen and driven by hand while it runs: ``make cell LIVE=1``.

`panel` is the panel by which it is driven, a chart; `session` keeps what was done there and does it
again; `source` shows boards and plant to the hub of fsmkit; `serving` puts it all on a page.
"""
