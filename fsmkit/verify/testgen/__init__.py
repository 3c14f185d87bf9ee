"""Tests from paths: counterexamples and covering suites in, pytests and C programs out."""
