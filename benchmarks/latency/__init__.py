"""Measure round trips between two real-time nodes, and compare loop jitter with cyclictest."""
