"""State diagrams of Mermaid as a plug-in."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation("mermaid", (".mmd", ".mermaid"), __package__)
