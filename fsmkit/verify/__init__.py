"""What proves: closed systems, their exploration, their properties and counterexamples."""
