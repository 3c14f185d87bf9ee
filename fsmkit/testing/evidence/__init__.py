"""Evidence for an assessor: analyses of generated C, and one report of all results."""
