"""What runs, seen while it runs: sessions that can be stopped, taken back and asked why.

A chart or a system in, messages of the protocol `fsmkit.live` out. `hub` obeys commands and knows
neither sockets nor clocks; page, debug adapter and shell are faces of it.
"""
