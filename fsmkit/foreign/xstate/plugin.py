"""Machines of XState 5 as a plug-in: JSON, JavaScript and TypeScript."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation(
    "xstate",
    (".json", ".ts", ".tsx", ".mts", ".cts", ".js", ".jsx", ".mjs", ".cjs"),
    __package__,
    r'"states"\s*:\s*\{|createMachine',
)
