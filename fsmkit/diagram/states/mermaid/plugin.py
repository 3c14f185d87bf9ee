"""Charts as Mermaid's state diagrams, which Git forges and wikis show."""

from fsmkit.plugins import Notation

PLUGIN = Notation("mermaid", (".mmd", ".mermaid"), __package__)
