"""CAN: messages of a DBC file in, their signals as types, values and charts out; response times.

From here on each signal has a type of the action language, and each message a place in its file.
"""
