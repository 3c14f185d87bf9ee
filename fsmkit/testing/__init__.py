"""Shipped tests: random charts and scripts, and the differential test over all targets."""
