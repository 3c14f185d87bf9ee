"""The trace of a target: records of 1 to 4 bytes, read with the chart by its hash.

* ``numbering``: the number of each item of a chart
* ``records``: the records and their bytes
* ``stream``: reads arriving bytes and counts every loss
* ``framing``: frames for a line that loses bytes
* ``merging``: merges the traces of several contexts
* ``following``: replays the trace in the interpreter
* ``transports``: the sources of bytes
"""
