"""Generate tests from paths: counterexamples and covering suites become pytests and C programs."""
