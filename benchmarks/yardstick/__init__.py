"""The yardstick: three charts, streams of events for them, and machines written by hand.

``A.scxml``, ``B.scxml`` and ``C.scxml`` are the charts. `model` interprets them independently of
fsmkit; its digests define what every machine must do. ``by_hand`` holds the machines in C and in
Python: what a person would write for exactly this chart, with no queue and no timers.
"""
