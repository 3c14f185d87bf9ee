"""Aldebaran files: transition systems for mCRL2 and CADP."""
