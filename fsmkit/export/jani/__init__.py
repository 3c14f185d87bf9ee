"""JANI for Storm and other tools: an automaton for each machine, its state in global variables."""
