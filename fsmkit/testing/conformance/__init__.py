"""Public test suites: a folder of them in, a verdict for each test out, on any runtime."""
