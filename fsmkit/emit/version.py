"""The version of fsmkit, which generated files name."""

VERSION = "1.0.0"
