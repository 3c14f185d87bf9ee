"""Dense time: models of the literature as charts, and a simple zone search of their networks."""
