"""Interactive sessions of charts and systems: pause, step back, fork, and query.

The input is a chart or a system, the output messages of the protocol `fsmkit.live`. `hub` executes
commands without sockets and clocks. Page, debug adapter and shell are its front ends.
"""
