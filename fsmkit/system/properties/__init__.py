"""Read ``properties:`` of a system file as a list of `Property`.

A kind of property is one file in ``kinds``, found by looking: its key, its form, its decision
procedure and the meaning of its verdict. Engines and exporters use these, and never its name.
"""
