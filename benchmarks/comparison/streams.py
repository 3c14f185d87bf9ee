"""The streams of events and the digests of the work done, from the normative model."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.comparison.folder import Folder, UnavailableError

EVENTS = 1_000_000
"""In a stream; the model writes its file for this number only."""

FNV_OFFSET = 2166136261
FNV_PRIME = 16777619
MASK = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Digests:
    """What a run must have done. Eight hexadecimal digits each."""

    work: str
    """Of all variables at the end, the counters of entries and exits among them."""
    path: str
    """Of the variable ``n`` after each event."""
    order: str
    """Of the sequence of entries and exits."""


@dataclass(frozen=True, slots=True)
class Stream:
    """A chart's events, as numbers into ``names``, and what the whole of them does."""

    letter: str
    names: tuple[str, ...]
    """Of the events."""
    variables: tuple[str, ...]
    """All variables in the order of the digest."""
    states: tuple[str, ...]
    """Of those whose entries and exits are counted, at their number; empty for the others."""
    file: Path
    events: bytes
    digests: Digests


def digest(values: list[int]) -> str:
    """Return the FNV-1a digest, by words of 32 bits, of values modulo 2^32."""
    found = FNV_OFFSET
    for value in values:
        found = ((found ^ (value & MASK)) * FNV_PRIME) & MASK
    return f"{found:08x}"


def load_model(folder: Folder) -> ModuleType:
    """Return the normative model as a module."""
    spec = importlib.util.spec_from_file_location("yardstick_model", folder.model)
    if spec is None or spec.loader is None:
        raise UnavailableError(f"{folder.model} is no Python module")
    model = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(model)
    return model


def make_stream(model: ModuleType, folder: Folder, letter: str, work: Path) -> Stream:
    """Return the stream of a chart; what took long to interpret is kept in ``work``."""
    chart = model.CH[letter]()
    file, known = work / f"ev_{letter}.bin", work / f"ev_{letter}.json"
    version = hashlib.sha256(folder.model.read_bytes()).hexdigest()
    kept = json.loads(known.read_text(encoding="utf-8")) if known.is_file() else {}
    if kept.get("model") == version and file.is_file():
        digests = Digests(**kept["digests"])
    else:
        with contextlib.chdir(work):
            digests = _digests(model.golden(chart, EVENTS))
        text = json.dumps({"model": version, "digests": asdict(digests)})
        known.write_text(text, encoding="utf-8")
    return Stream(
        letter,
        tuple(chart.events),
        variables(chart),
        tuple(name if chart.states[name].act else "" for name in chart.order),
        file,
        file.read_bytes(),
        digests,
    )


def variables(chart: Any) -> tuple[str, ...]:
    """Return the variables of a chart of the model: the declared ones, then the counters."""
    counted = any(chart.states[name].act for name in chart.order)
    counters = range(2 * len(chart.order)) if counted else range(0)
    return (*chart.vars, *(f"c{number}" for number in counters))


def digests_of(model: ModuleType, stream: Stream, events: bytes) -> Digests:
    """Return what a shorter or a different stream of the same chart does."""
    return _digests(model.golden(model.CH[stream.letter](), len(events), events))


def _digests(found: dict[str, Any]) -> Digests:
    return Digests(found["digest"], found["nh"], found["sig"])
