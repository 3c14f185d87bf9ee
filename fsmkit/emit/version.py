"""The version of fsmkit, which generated files name."""

VERSION = "0.1.0"
