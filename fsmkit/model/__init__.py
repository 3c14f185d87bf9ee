"""Document, Chart, structure, passes and checks: from what was written to what it means."""
