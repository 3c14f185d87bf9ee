"""The hub of a page, in Node, and the hub in Python: the same commands to both."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fsmkit.inspector import bundle
from fsmkit.inspector.hub import Hub
from fsmkit.system.system import System

DRIVER = """\
const { readFileSync } = require("node:fs");
const jobs = JSON.parse(readFileSync(0, "utf8"));
const told = jobs.map(({ file, seed, commands }) => {
  const offline = new Function(readFileSync(file, "utf8") + "return offline;")();
  const hub = new offline.Hub(offline.description, { seed });
  let now = [];
  hub.join((messages) => now.push(...JSON.parse(JSON.stringify(messages))));
  const found = [now];
  for (const command of commands) {
    now = [];
    if (command.do === "advance") hub.advance(command.us);
    else now.push(hub.receive(command));
    found.push(now);
  }
  return found;
});
process.stdout.write(JSON.stringify(told));
"""
EXPRESSION = ("type-mismatch", "chained-comparison", "wrong-command", "integer-too-wide")
"""Rules by which one or the other refuses an expression."""
Json = dict[str, Any]
Job = tuple[System, Sequence[Json]]


def in_node(jobs: Sequence[Job], *, seed: int = 1, **options: Any) -> list[list[list[Json]]]:
    """Return, for each job and each of its commands, the messages."""
    node = shutil.which("node")
    assert node is not None
    with tempfile.TemporaryDirectory(prefix="fsmkit_") as folder:
        given = []
        for number, (system, commands) in enumerate(jobs):
            file = Path(folder) / f"{number}.js"
            file.write_text(bundle.script(system, **options), encoding="utf-8")
            given.append({"file": str(file), "seed": seed, "commands": numbered(commands)})
        (Path(folder) / "driver.cjs").write_text(DRIVER, encoding="utf-8")
        done = subprocess.run(
            [node, str(Path(folder) / "driver.cjs")],
            input=json.dumps(given), capture_output=True, encoding="utf-8", check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    found: list[list[list[Json]]] = json.loads(done.stdout)
    return found


def numbered(commands: Sequence[Json]) -> list[Json]:
    return [{"id": number, **command} for number, command in enumerate(commands, 1)]


def in_python(system: System, commands: Sequence[Json], *, seed: int = 1) -> list[list[Json]]:
    """Return the same of the hub in Python."""
    now: list[Json] = []

    def take(text: bytes) -> None:
        message = json.loads(text)
        now.extend(message if isinstance(message, list) else [message])

    hub = Hub(system, seed=seed)
    client = hub.join(take)
    found = [now]
    for command in numbered(commands):
        found.append(now := [])
        if command["do"] == "advance":
            hub.advance(command["us"])
        else:
            hub.receive(client, json.dumps(command))
    return found


def compared(found: Sequence[Sequence[Json]]) -> list[list[Json]]:
    """Return messages without what the two say in words of their own."""
    return [[_plain(message) for message in messages] for messages in found]


def _plain(message: Json) -> Json:
    left_out = {"session", "can", "help", "client", "folds"}
    if message["k"] == "refused":
        left_out |= {"message"}
        if message["rule"] in EXPRESSION:
            left_out |= {"rule"}
    return {key: _same(value) for key, value in message.items() if key not in left_out}


def _same(value: Any) -> Any:
    """Return JSON in which `True` and `1` differ, and reasons of errors do not."""
    match value:
        case bool():
            return str(value)
        case dict():
            return {k: "" if k == "error" else _same(part) for k, part in value.items()}
        case list():
            return [_same(part) for part in value]
        case _:
            return value
