"""Measure the worst case of each event of hand-written and generated machines on a Cortex-M0."""
