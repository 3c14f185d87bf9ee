"""FMUs: a chart goes in, a unit for co-simulation by FMI 3.0 or 2.0 comes out.

The machine is that of the C target. The functions of FMI are static C, driven by the machine's
table. The generated parts are the mapping of that table to variables of the FMU, and their
description.
"""
