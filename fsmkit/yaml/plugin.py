"""The YAML notation as a plug-in."""

from fsmkit.document.front_ends import Notation

PLUGIN = Notation("yaml", (".yaml", ".yml"), __package__, decoder="encoding")
