"""Promela for SPIN: a process for each machine, a channel for each queue."""
