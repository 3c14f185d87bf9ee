"""What generated Python machines are made of besides their chart: copied into each of them.

The files here are ordinary modules, linted, typed and tested as such; the Python target pastes
the texts of `arithmetic` and of the body of `machine.Machine`, so that a generated module stands
alone.
"""
