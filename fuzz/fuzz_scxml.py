"""Bytes as a chart in SCXML."""

from __future__ import annotations

import atheris

with atheris.instrument_imports(include=["fsmkit"]):
    from fuzzing import front_end, fuzz

    from fsmkit.scxml.nodes import decode
    from fsmkit.scxml.reader import read_document


def target(content: bytes) -> None:
    """Read and elaborate."""
    front_end(content, "fuzz.scxml", decode, read_document)


if __name__ == "__main__":
    fuzz(target, ".scxml")
