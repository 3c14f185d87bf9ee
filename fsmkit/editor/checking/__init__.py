"""Checks in the background: a child process for each, whose verdicts become findings."""
