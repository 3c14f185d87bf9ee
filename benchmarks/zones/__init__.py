"""Dense time: models of the literature as charts, beside a simple zone search of their networks."""
