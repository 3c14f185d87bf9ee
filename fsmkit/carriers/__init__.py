"""Carriers transport frames between nodes, and connect nodes with other programs and wires.

A carrier is one folder: ``plugin.py`` implements the protocols, ``keys.py`` has the keys of files,
``c`` its C. docs/how-to/add-a-carrier.md describes the protocols. Carriers never import each other.
"""
