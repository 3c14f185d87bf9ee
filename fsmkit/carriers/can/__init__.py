"""CAN: the bus that nodes share, foreign nodes on a bus, DBC files, and response times.

`dbc` assigns each signal of a DBC file a type of the action language; `bus` creates the messages of
a bus of nodes. `link` and `translator` exchange them in Python, the C in ``c`` by the tables of
`tables`.
"""
