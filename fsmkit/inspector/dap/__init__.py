"""The Debug Adapter Protocol: a session of the hub as a program that an editor debugs.

Machines are threads, active states stack frames, lines of YAML and SCXML breakpoints. `adapter`
answers requests and knows neither streams nor clocks; `serving` has both.
"""
