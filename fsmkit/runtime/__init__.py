"""What runs: a Chart or a System in, macrosteps out.

The reference interpreter, sessions and clocks, and what ships with machines. The interpreter knows
neither `analysis` nor `plan`.
"""
