"""Faults that are seeded into a machine or its generator, and whether certificates find them."""
