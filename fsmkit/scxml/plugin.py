"""The SCXML notation as a plug-in."""

from fsmkit.document.front_ends import Notation

PLUGIN = Notation("scxml", (".scxml", ".xml"), __package__, decoder="nodes")
