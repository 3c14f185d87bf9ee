"""The parts of generated Python machines that do not depend on their chart.

The files are ordinary modules: linted, typed and tested. The Python target copies `arithmetic` and
the body of `machine.Machine` into each generated module, so that it has no dependencies.
"""
