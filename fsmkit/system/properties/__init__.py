"""What must hold of a system: ``properties:`` of its file goes in, a `Property` each comes out.

A kind of property is one file in ``kinds``, found by looking: its key, its form, how it is decided
and what its verdict means. From here on no engine and no exporter needs its name, only that.
"""
