"""StateSmith diagrams as a plug-in."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation(
    "statesmith",
    (".puml", ".plantuml", ".drawio", ".drawio.svg", ".graphml"),
    __package__,
)
