"""Bytes as a chart in YAML."""

from __future__ import annotations

from collections.abc import Iterator

import atheris

with atheris.instrument_imports(include=["fsmkit"]):
    from devtools.fuzz.fuzzing import fuzz
    from devtools.fuzz.through import through
    from fsmkit.yaml.plugin import PLUGIN

from devtools.fuzz.seeds import charts, strings_of_tests
from devtools.fuzz.yaml_mutation import cross, mutate


def seeds() -> Iterator[str]:
    """Yield charts, and the parts of charts in the tests."""
    yield from charts(".yaml")
    for text in strings_of_tests():
        if "states:" in text or "chart:" in text:
            yield text
            yield f"chart: T\n{text}"


def target(content: bytes) -> None:
    """Take them as far as they go."""
    through(content, "fuzz.yaml", PLUGIN)


if __name__ == "__main__":
    fuzz(target, seeds, mutate, cross)
