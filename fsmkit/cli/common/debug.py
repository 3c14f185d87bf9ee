"""Launch configurations of an editor: each counterexample of ``fsmkit check``, from its end."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.emit import plain
from fsmkit.verify.report.verdict import Report

VERSION = "0.2.0"
"""Version of the format of `launch.json`."""
TRACES = "traces"
"""The default folder of traces, beside the configurations."""


def read_configurations(path: Path) -> dict[str, Any]:
    """Return the content of a file of configurations; empty if the file is missing.

    Raises `FsmkitError` (``unwritable-output``) if it cannot be extended.
    """
    if not path.exists():
        return {"version": VERSION, "configurations": []}
    try:
        found = parse_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise _unusable(path, (error.strerror or "it cannot be read").lower()) from error
    except ValueError as error:
        raise _unusable(path, "it is not plain JSON, perhaps because of comments") from error
    own = found.get("configurations", []) if isinstance(found, dict) else None
    if not isinstance(own, list) or not all(isinstance(each, dict) for each in own):
        raise _unusable(path, "it has no list of configurations")
    return {**found, "configurations": own}


def with_counterexamples(
    before: Mapping[str, Any], report: Report, traces: Mapping[str, Path]
) -> str | None:
    """Return the configurations with the counterexamples added; None if none is new.

    An existing configuration of the same name gets the trace and keeps its other keys. ``traces``:
    files, by property.
    """
    system = plain(report.closed.system.name)
    made: list[dict[str, str]] = [
        {
            "type": "fsmkit",
            "request": "launch",
            "name": f"{system}: {plain(name)}",
            "program": str(path.resolve()),
        }
        for name, path in traces.items()
    ]
    names = {each["name"]: each for each in made}
    kept = [{**each, **names.pop(each.get("name"), {})} for each in before["configurations"]]
    after = {**before, "configurations": [*kept, *names.values()]}
    return None if after == before else json.dumps(after, indent=2, ensure_ascii=False) + "\n"


def _unusable(path: Path, why: str) -> FsmkitError:
    return fail(
        "unwritable-output",
        f"no configuration can be added to `{path}`: {why}",
        help="name another file, and copy its configurations",
    )
