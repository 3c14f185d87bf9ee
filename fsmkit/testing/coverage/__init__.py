"""Measure the coverage of charts by tests: states, transitions, decisions and conditions.

A `Recorder` observes machines; its counts are files that can be added in any order.
"""
