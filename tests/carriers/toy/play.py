"""Uses the carrier of `fsmkit_files` as its users do; writes what happened as JSON."""

import json
import sys
from pathlib import Path

import fsmkit
from fsmkit.diagnostics import FsmkitError
from fsmkit.diagnostics.source import Source
from fsmkit.editor.cursor.keys_at import slot_at
from fsmkit.editor.formatting import format_source
from fsmkit.editor.schemas.models import deployment_schema
from fsmkit.runtime.node import Node

FOLDER = Path(sys.argv[1])
DEPLOYMENT = FOLDER / "deployment.yaml"
TEXT = DEPLOYMENT.read_text()


def findings_of(old: str, new: str) -> list[list[str]]:
    """Return the rules and messages of a deployment with a change."""
    path = FOLDER / "changed.yaml"
    path.write_text(TEXT.replace(old, new))
    try:
        fsmkit.read(path)
    except FsmkitError as error:
        return [[each.rule.name, each.message] for each in error.diagnostics]
    return []


def played() -> dict[str, object]:
    """Return what two nodes did that exchange frames by files."""
    deployment = fsmkit.read(DEPLOYMENT)
    assert isinstance(deployment, fsmkit.Deployment)
    with Node(deployment, "wall", session=1) as wall, Node(deployment, "hall", session=2) as hall:
        wall.link.wait_listeners(1)
        for now in range(50):
            if now % 10 == 5:
                wall.machines.post("button", "press")
            wall.cycle(now)
            hall.cycle(now)
        return {
            "kind": type(wall.link).__name__,
            "presses": wall.machines.value("button", "presses"),
            "changes": hall.machines.value("lamp", "changes"),
            "lit": list(wall.machines.snapshot("button").inputs),
            "lost": wall.link.counters("hall").lost_frames,
        }


def overridden() -> list[list[str]]:
    """Return what is found where a program opens another kind than that of the deployment."""
    deployment = fsmkit.read(DEPLOYMENT)
    assert isinstance(deployment, fsmkit.Deployment)
    found = []
    for kind in ("can", "files", "in_process", "zeromq", "none"):
        for options in ({}, {"hue": 1}):
            try:
                Node(deployment, "wall", session=1, kind=kind, options=options).close()
            except FsmkitError as error:
                found += [[kind, each.rule.name] for each in error.diagnostics]
    return found


def completed(at: str) -> list[str]:
    """Return the keys, or words, that the editor proposes after a text."""
    slot = slot_at(DEPLOYMENT, Source("deployment.yaml", TEXT), TEXT.index(at) + len(at))
    return [*slot.table, *slot.words]


RESULTS = {
    "played": played(),
    "overridden": overridden(),
    "kind": findings_of("kind: files", "kind: filez"),
    "missing": findings_of("  folder: frames\n", ""),
    "own": findings_of("folder: frames", "folder: ~/frames"),
    "foreign": findings_of("kind: files", "kind: zeromq"),
    "keys": completed("links:\n  "),
    "words": completed("kind: "),
    "schema": [*deployment_schema()["properties"]["links"]["properties"]],
    "formatted": format_source(TEXT, "deployment.yaml"),
}
sys.stdout.write(json.dumps(RESULTS))
