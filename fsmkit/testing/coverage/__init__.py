"""Coverage of charts by tests: states, transitions, decisions and conditions of guards.

Machines come in through a `Recorder`, counts go out as files that add up in any order.
"""
