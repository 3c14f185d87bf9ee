"""Verbs for editors and files of fsmkit itself."""
