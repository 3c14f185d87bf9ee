"""Networks of timed automata for UPPAAL: a symbolic translation of a closed system.

`network` is the model of a file, `writing` its text, `wellformed` the rules that
UPPAAL enforces late or not at all. `translate` makes a network of a closed system (its meaning:
`verify.statespace.closed_system`), from the macrosteps that `paths` records of the reference
interpreter.
"""
