"""Networks of timed automata for UPPAAL: a symbolic translation of a closed system.

`network` is the model of a file, `writing` its text, `wellformed` the rules that UPPAAL enforces
late or not at all. `translate` creates a network from a closed system (its semantics:
`verify.statespace.closed_system`), by the macrosteps that `paths` records of the reference
interpreter.
"""
