"""Machines drawn with QM, the modeling tool of the QP frameworks (``.qm``)."""
