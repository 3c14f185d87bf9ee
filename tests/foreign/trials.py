"""All that a stranger does with a chart of his: each verb on it, and the laws of its answer.

A trial is one chart, in a folder of its own with the files that lie beside it. Its problems are
lines that begin with their kind: `traceback`, `hang`, `exit N`, `time` (runs backwards), `json`,
`round trip`, `refused by TOOL`.
"""

from __future__ import annotations

import json
import random
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from fsmkit import read_chart
from fsmkit.inspector.hub import Hub
from fsmkit.runtime.live.messages import from_json
from fsmkit.runtime.live.steps import hash_of
from fsmkit.runtime.script import is_received
from tests.foreign.child import Ended, fsmkit

LIMIT = 60.0
"""Seconds that any command may take; a chart of 4,000 states is among the public data."""
CHECKED = 5.0
"""Seconds given to `check` and `export` by `--timeout`, where nothing else is said."""
OVERTIME = 10.0
"""Seconds after which `--timeout` was not kept: the machine may be busy."""
STEPS = 12
"""Events of a random run."""
LARGEST_PICTURE = 300
"""States that Graphviz lays out in reasonable time."""
NOTATIONS = {
    "uppaal": "xml", "uppaal-flat": "xml", "cspm": "csp", "promela": "pml", "jani": "jani",
    "aut": "aut", "dot": "dot",
}  # fmt: skip
C_FORMS: Mapping[str, Sequence[str]] = {
    "c": (), "size": ("--optimize", "size"),
}  # fmt: skip
_UNITS = {"us": 1, "ms": 1_000, "s": 1_000_000, "m": 60_000_000, "h": 3_600_000_000}
_TEXT_TIME = re.compile(r"^ *(\d+(?:\.\d+)?) ?(us|ms|s|m|h)\b", re.MULTILINE)
_TRACE_TIME = re.compile(r"^@(\d+) ", re.MULTILINE)


@dataclass
class Tried:
    """What came of one chart: how many commands ran, what was wrong, and what others must read."""

    chart: str
    commands: int = 0
    problems: list[str] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    is_chart: bool = True


@dataclass
class Trial:
    """One chart under trial; ``folder`` is its own, and may be written to."""

    chart: Path
    folder: Path
    name: str
    seed: int = 1
    checked: float = CHECKED
    """Seconds given to `check` and to each `export`."""

    def __post_init__(self) -> None:
        self.tried = Tried(self.name)
        self._states = 0

    def run(self, *argv: str, allowed: Sequence[int] = (0,), limit: float = LIMIT) -> Ended:
        """Run a command and note what no command may do."""
        ended = fsmkit(argv, self.chart.parent, limit)
        self.tried.commands += 1
        self.tried.problems += ended.problems(*allowed)
        return ended

    def json_of(self, ended: Ended) -> Any:
        """Return the one JSON document that a command printed, or None."""
        try:
            return json.loads(ended.out)
        except ValueError as error:
            self.tried.problems.append(f"json: `fsmkit {' '.join(ended.argv)}`: {error}")
            return None

    def all(self) -> Tried:
        """Do everything with the chart."""
        shown = self.run("show", self.chart.name, "--json", allowed=(0, 1))
        if shown.code != 0:
            self._refused(shown)
            return self.tried
        document = self.json_of(shown) or {}
        self.run("show", self.chart.name)
        self.run("show", self.chart.name, "--plan")
        self._states = len(document.get("states", ()))
        events = random_events(document, random.Random(self.seed))
        self._runs(events)
        self._sessions()
        self._checks()
        self._draws()
        self._compiles()
        self._converts(events)
        self._exports()
        return self.tried

    def _refused(self, shown: Ended) -> None:
        """A chart that is refused is refused alike by the other verbs, without anything written."""
        if "FK" not in shown.err:
            self.tried.problems.append(f"no finding: `fsmkit show {self.chart.name}`: {shown.err}")
        self.tried.is_chart = False
        for argv in (("run", "--events", ""), ("check",), ("draw",), ("compile", "--out", "no")):
            self.run(argv[0], self.chart.name, *argv[1:], allowed=(1,))
        if (self.folder / "no").exists():
            self.tried.problems.append("refused, but something was written")

    def _runs(self, events: str) -> None:
        """Run it as people see it and as programs do: time never runs backwards.

        A machine may stop with a fault (exit 1), if each form says so.
        """
        argv = ("run", self.chart.name, "--events", events)
        text = self.run(*argv, allowed=(0, 1))
        self._monotonic(text, _TEXT_TIME.findall(text.out))
        trace = self.run(*argv, "--trace", allowed=(0, 1))
        self._monotonic(trace, [(at, "us") for at in _TRACE_TIME.findall(trace.out)])
        ended = self.run(*argv, "--json", allowed=(0, 1))
        if None in (text.code, trace.code, ended.code):
            return
        document = self.json_of(ended)
        if document is None:
            return
        self._monotonic(ended, [(str(step["at"]), "us") for step in document["steps"]])
        lines = iter(trace.out.splitlines())  # also of what was refused, which is no step
        if not all(line in lines for step in document["steps"] for line in step["trace"]):
            self.tried.problems.append("json: `run --json` and `run --trace` differ")
        if len({text.code, trace.code, ended.code, int(document["fault"] is not None)}) > 1:
            self.tried.problems.append("exit: the forms of `run` do not agree on a fault")

    def _monotonic(self, ended: Ended, times: Sequence[tuple[str, str]]) -> None:
        at = [float(number) * _UNITS[unit] for number, unit in times]
        if any(later < earlier for earlier, later in pairwise(at)):
            self.tried.problems.append(f"time: `fsmkit {' '.join(ended.argv)}` runs backwards")
        if ended.code == 0 and not at:
            self.tried.problems.append(f"time: `fsmkit {' '.join(ended.argv)}` prints no step")

    def _sessions(self) -> None:
        """Look at it as `fsmkit serve` does: each message is one of the protocol."""
        told: list[bytes] = []
        try:
            hub = Hub(read_chart(self.chart))
            client = hub.join(told.append)
            name, chart = hub.simulation.names[0], hub.simulation.charts[0]
            said: list[dict[str, object]] = [{"do": "events", "m": name}]
            said += [{"do": "chart", "chart": hash_of(chart)}, {"do": "run", "speed": 0}]
            for number, command in enumerate(said):
                hub.receive(client, json.dumps({"id": number, **command}))
            hub.advance(1)
            for event in [each.name for each in chart.events if is_received(each)][:8]:
                hub.receive(client, json.dumps({"id": 1, "do": "why", "m": name, "event": event}))
                hub.receive(client, json.dumps({"id": 1, "do": "post", "m": name, "event": event}))
            for do in ("back", "forward"):
                hub.receive(client, json.dumps({"id": 1, "do": do}))
            for text in told:
                found = json.loads(text)
                for message in found if isinstance(found, list) else [found]:
                    from_json(json.dumps(message))
        except Exception as error:  # noqa: BLE001  (whatever it is, it is a problem)
            self.tried.problems.append(f"session: {error!r}")

    def _checks(self) -> None:
        limited = ("--timeout", f"{self.checked:g}s", "--memory", "1G")
        for form in ((), ("--json",)):
            argv = ("check", self.chart.name, *limited, *form)
            ended = self.run(*argv, allowed=(0, 1), limit=self.checked + OVERTIME)
            if form and ended.code is not None and ended.out:
                self.json_of(ended)

    def _draws(self) -> None:
        out = [self.folder / f"drawn.{suffix}" for suffix in ("dot", "mmd", "puml")]
        options = [word for path in out for word in ("--out", str(path))]
        if self.run("draw", self.chart.name, *options).code == 0:
            self.tried.written += out
        svg = self.folder / "drawn.svg"
        if (
            self._states <= LARGEST_PICTURE
            and shutil.which("dot")
            and not self.run("draw", self.chart.name, "--out", str(svg)).code
        ):
            self.tried.written.append(svg)

    def _compiles(self) -> None:
        for form, options in C_FORMS.items():
            out = self.folder / f"generated-{form}"
            if self.run("compile", self.chart.name, "--out", str(out), *options).code == 0:
                self.tried.written += sorted(out.glob("*.c"))
        for target in ("python", "transitions"):
            out = self.folder / f"generated-{target}"
            allowed = (0, 1) if target == "transitions" else (0,)
            argv = ("compile", self.chart.name, "--out", str(out), "--target", target)
            if self.run(*argv, allowed=allowed).code == 0:
                self.tried.written += sorted(out.glob("*.py"))

    def _converts(self, events: str) -> None:
        """Convert to YAML, to SCXML, to YAML: the texts are equal, and each does the same."""
        here = self.chart.parent
        names = ("converted.yaml", "converted.scxml", "again.yaml")
        before = self.chart.name
        for name in names:
            to = name.rpartition(".")[2]
            if self.run("convert", before, "--to", to, "--out", str(here / name)).code != 0:
                return
            before = name
        if (here / names[0]).read_text() != (here / names[2]).read_text():
            self.tried.problems.append("round trip: YAML, SCXML, YAML: the texts differ")
        traces = [
            self.run("run", name, "--events", events, "--trace", allowed=(0, 1)).out
            for name in (self.chart.name, *names[:2])
        ]
        for name, trace in zip(names, traces[1:], strict=False):
            if trace != traces[0]:
                self.tried.problems.append(f"round trip: {name} does something else")

    def _exports(self) -> None:
        for notation, suffix in NOTATIONS.items():
            out = self.folder / f"{notation}.{suffix}"
            limits = ("--timeout", f"{self.checked:g}s", "--max-states", "2000")
            argv = ("export", self.chart.name, "--to", notation, "--out", str(out), *limits)
            if self.run(*argv, allowed=(0, 1), limit=self.checked + OVERTIME).code == 0:
                self.tried.written.append(out)


def random_events(document: Mapping[str, Any], chance: random.Random) -> str:
    """Return random things for `run --events`: events with payloads, waiting, inputs."""
    types = {one["name"]: one for one in document.get("types", ())}
    events = [e for e in document.get("events", ()) if "in" in e["directions"]]
    items = []
    for _ in range(STEPS):
        event = chance.choice(events) if events else None
        if event is None or chance.random() < 0.4:
            items.append(f"wait {chance.choice(('0ms', '1ms', '500ms', '3s', '2m'))}")
            continue
        pairs = [f"{f['name']}={random_value(f['type'], types, chance)}" for f in event["fields"]]
        items.append(" ".join((event["name"], *pairs)))
    return "; ".join(items)


def random_value(type_: str, types: Mapping[str, Any], chance: random.Random) -> str:
    """Return the text of a value of a type as `show --json` writes it."""
    if span := re.match(r"(-?\d+)\.\.(-?\d+)", type_):
        return str(chance.randint(int(span[1]), int(span[2])))
    if members := types.get(type_, {}).get("members"):
        return str(chance.choice(members))
    match type_:
        case "bool":
            return chance.choice(("true", "false"))
        case "symbol":
            return chance.choice(('"OK"', '"a b"'))
        case "duration":
            return "10ms"
        case "float32" | "float64":
            return "1.5"
        case _:
            return str(chance.randint(0, 3))


def charts_below(folder: Path) -> Iterator[Path]:
    """Return all files that look like charts, in order."""
    for path in sorted(folder.rglob("*")):
        if path.suffix in {".scxml", ".yaml", ".yml"} and path.is_file():
            yield path
