"""The names of what every model has, chosen last: what people named comes first."""

from __future__ import annotations

from fsmkit.export.cspm.identifiers import Names


class Frame:
    """Channels, types, functions and variables of the frame of a model."""

    def __init__(self, names: Names) -> None:
        """Take the names."""
        new = names.new
        self.start, self.unseen, self.violated = new("start"), new("unseen"), new("violated")
        self.label, self.property = new("LABEL"), new("PROPERTY")
        self.alphabet, self.part, self.post = new("ALPHABET"), new("PART"), new("POST")
        self.network, self.system, self.visible = new("NETWORK"), new("SYSTEM"), new("VISIBLE")
        self.internal, self.only = new("INTERNAL"), new("ONLY")
        self.e, self.s, self.n, self.m = new("e"), new("s"), new("n"), new("m")
