"""The search in Python over the reference interpreter: slow and simple, the oracle of the other."""
