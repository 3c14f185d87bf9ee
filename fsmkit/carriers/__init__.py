"""What carries frames between nodes, and joins nodes with programs and wires that know no frames.

A carrier is one folder: ``plugin.py`` says what it can do, ``keys.py`` has the keys of files, ``c``
its C. docs/how-to/add-a-carrier.md describes the protocols. Carriers never import each other.
"""
