"""Coverage of charts by tests: states, transitions, decisions and conditions of guards.

Machines come in through an `Observer`, counts go out as files that add up in any order.
"""
