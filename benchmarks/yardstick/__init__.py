"""The yardstick: three charts, streams of events for them, and handwritten machines.

``A.scxml``, ``B.scxml`` and ``C.scxml`` are the charts. `model` interprets them independently of
fsmkit; its digests define the required behaviour. ``by_hand`` holds the machines in C and in
Python, as a person would write them for exactly this chart, without queue and timers.
"""
