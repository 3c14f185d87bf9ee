"""The search in Python over the reference interpreter: slow, plain, the oracle of the other."""
