"""Certificates of invariants: the set of reachable states, which another program can check.

``fsmkit check SYSTEM --certificate FILE`` writes one (`certificate`). `checker.js` checks it: the
initial states are in the set, each step leads to a state of the set, and the covered properties
hold in each state. `steps` performs the steps of one state for it.
"""
