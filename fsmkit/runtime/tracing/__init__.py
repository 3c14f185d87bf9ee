"""The trace of a target: records of 1 to 4 bytes, read with the chart by its hash.

``numbering``: which number stands for which thing of a chart. ``records``: the records and their
bytes. ``stream``: bytes as they come, with all that is lost or spoilt counted. ``framing``: frames
for a line that loses bytes. ``merging``: several contexts as one. ``following``: what the machine
did, computed again by the interpreter. ``carriers``: where the bytes come from.
"""
