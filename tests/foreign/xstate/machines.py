"""Random machines of XState, run by the library under node and as the charts they are read into."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit import Session
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source
from fsmkit.foreign.xstate.reader import import_machine, machines
from fsmkit.runtime.clock import SimulatedClock

NODE_FOLDER = Path(__file__).parents[3] / "build" / "node"
DRIVER = Path(__file__).with_name("driver.mjs")
EVENTS = ("A", "B", "C", "x", "x.y", "x.y.z")
KEYS = (*EVENTS, *EVENTS, "*", "x.*", "x.y.*")
GUARDS = ("g0", "g1", "g2")
SWAP = (
    "assign({n: ({context}) => context.on ? 1 : context.n * 2 % 7, "
    "on: ({context}) => context.n > 1})"
)
DELAYS = (101, 211, 307, 401, 503)


@dataclass
class Job:
    """A machine and its script: times in milliseconds, and events."""

    source: Source
    job: dict[str, Any]
    script: list[tuple[int, dict[str, Any]]]


@dataclass
class _Author:
    """Writes the configuration of one machine, as an object of JavaScript."""

    choices: Choices
    is_program: bool
    states: list[str] = field(default_factory=list)
    finals: set[str] = field(default_factory=set)
    histories: dict[str, str] = field(default_factory=dict)
    parents: dict[str, str] = field(default_factory=dict)
    actions: set[str] = field(default_factory=set)

    def machine(self) -> dict[str, Any]:
        """Return the configuration."""
        root = self._tree(3, None, "root")
        root["id"] = "root"
        if self.is_program:
            root["context"] = {"n": 0, "on": False}
        self._fill(root, "root")
        return root

    def _tree(self, depth: int, parent: str | None, name: str) -> dict[str, Any]:
        if parent is not None:
            self.parents[name] = parent
        kind = self.choices.integer(0, 9) if parent is not None else self.choices.integer(3, 9)
        if parent is not None and (depth == 0 or kind < 4):
            return self._leaf(name)
        is_parallel = kind >= 7
        found: dict[str, Any] = {"states": {}}
        for _ in range(self.choices.integer(2, 3)):
            child = f"s{len(self.states)}"
            self.states.append(child)
            tree = self._tree(depth - 1, name, child)
            if is_parallel and tree.get("type") == "final":
                tree = {}
                self.finals.discard(child)
            found["states"][child] = tree
        if self.choices.chance(15):
            child = f"h{len(self.histories)}"
            self.histories[child] = name
            deep = self.choices.chance(50)
            found["states"][child] = {"type": "history", "history": "deep" if deep else "shallow"}
        if is_parallel:
            found["type"] = "parallel"
        else:
            children = [c for c in found["states"] if c in self.states]
            found["initial"] = self.choices.pick(children)
        return found

    def _leaf(self, name: str) -> dict[str, Any]:
        if self.choices.chance(15):
            self.finals.add(name)
            return {"type": "final"}
        return {}

    def _fill(self, config: dict[str, Any], name: str) -> None:
        if config.get("type") == "history":
            config["id"] = name
            return
        if name != "root":
            config["id"] = name
        if self.choices.chance(75) and name != "root":
            config["entry"] = [f"in_{name}"]
            config["exit"] = [f"out_{name}"]
            self.actions |= {f"in_{name}", f"out_{name}"}
        if name not in self.finals:
            on = {
                self.choices.pick(KEYS): self._transitions(name)
                for _ in range(self.choices.integer(0, 3))
            }
            if on and (name != "root" or self.choices.chance(30)):
                config["on"] = on
            if self.choices.chance(20) and name != "root":
                config["after"] = {
                    self.choices.pick(DELAYS): self._transitions(name)
                    for _ in range(self.choices.integer(1, 2))
                }
            if self.choices.chance(12) and name != "root":
                config["always"] = [self._always(name)]
            is_done = "initial" in config or self.choices.chance(30)
            if self.choices.chance(25) and is_done and "states" in config and name != "root":
                config["onDone"] = self._transitions(name)
        if "initial" in config and self.choices.chance(8):
            config["initial"] = {"target": config["initial"], "actions": [self._named(name)]}
        for child, inner in config.get("states", {}).items():
            self._fill(inner, child)

    def _transitions(self, name: str) -> Any:
        return [self._transition(name) for _ in range(self.choices.integer(1, 2))]

    def _always(self, name: str) -> dict[str, Any]:
        """Return an eventless transition to a later state, so that no machine loops."""
        place = self.states.index(name) + 1
        later = self.states[place:] or self.states[:1]
        return {"guard": self.choices.pick(GUARDS), "target": f"#{self.choices.pick(later)}"}

    def _transition(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if self.choices.chance(80):
            outside = [h for h, p in self.histories.items() if not self._is_below(name, p)]
            names = [*self.states, *outside, *outside]
            found["target"] = f"#{self.choices.pick(names)}"
            if self.choices.chance(20) and name != "root":
                found["target"] = f"#{name}"
        if self.choices.chance(35):
            found["guard"] = self._guard()
        if self.choices.chance(60):
            found["actions"] = [self._action(name) for _ in range(self.choices.integer(1, 2))]
        if self.choices.chance(20):
            found["reenter"] = True
        return found

    def _is_below(self, name: str, ancestor: str) -> bool:
        while name in self.parents:
            name = self.parents[name]
            if name == ancestor:
                return not self.choices.chance(5)
        return False

    def _guard(self) -> Any:
        if not self.is_program or self.choices.chance(40):
            return self.choices.pick(GUARDS)
        return Raw(
            self.choices.pick(
                (
                    "({context}) => context.n % 3 === 1",
                    "({context}) => context.on && context.n < 5",
                    "({context: {n, on}}) => !on || n > 2",
                    "and(['g0', ({context}) => context.on])",
                    "or(['g1', not('g2')])",
                    f"stateIn('#{self.choices.pick(self.states)}')",
                    "({event}) => event.v > 4",
                )
            )
        )

    def _named(self, name: str) -> str:
        action = f"do_{name}"
        self.actions.add(action)
        return action

    def _action(self, name: str) -> Any:
        wish = self.choices.integer(0, 9)
        if not self.is_program or wish < 4:
            if wish == 9:
                self.actions.add("shown")
                return {"type": "shown", "params": {"level": self.choices.integer(0, 9)}}
            return self._named(name)
        other = self.choices.pick(EVENTS[3:])
        return Raw(
            (
                "assign({n: ({context}) => context.n + 1})",
                "assign({on: ({context}) => !context.on})",
                SWAP,
                f"raise({{type: '{other}', v: {self.choices.integer(0, 9)}}})",
                f"raise({{type: 'B', v: 1}}, {{delay: {self.choices.pick((53, 97))}}})",
                "assign(({context, event}) => ({n: Math.max(context.n, event.v)}))",
            )[wish - 4]
        )


class Raw(str):
    """An expression of JavaScript."""

    __slots__ = ()


def program(value: object) -> str:
    """Return a configuration as an expression of JavaScript."""
    match value:
        case Raw():
            return str(value)
        case dict():
            return "{" + ", ".join(f"{json.dumps(k)}: {program(v)}" for k, v in _keys(value)) + "}"
        case list():
            return "[" + ", ".join(map(program, value)) + "]"
        case _:
            return json.dumps(value)


def _keys(value: dict[Any, Any]) -> Iterator[tuple[str, Any]]:
    return ((str(key), each) for key, each in value.items())


def random_job(choices: Choices, length: int) -> Job:
    """Return a machine and a script."""
    author = _Author(choices, choices.chance(50))
    config = author.machine()
    handled = _handled(program(config))
    script = []
    now = 0
    for _ in range(length):
        now += choices.pick((0, 1, 50, 250, 500))
        script.append((now, {"type": choices.pick(handled), "v": choices.integer(0, 9)}))
    job: dict[str, Any] = {
        "script": script,
        "actions": sorted(author.actions),
        "guards": list(GUARDS),
    }
    if author.is_program:
        text = f"createMachine({program(config)})"
        job["program"] = text
        source = Source("random.ts", f"export const machine = {text};\n")
    else:
        job["config"] = config
        source = Source("random.json", json.dumps(config, indent=1))
    return Job(source, job, script)


def _handled(text: str) -> list[str]:
    """Return the events that some state has a transition for: the library tries eventless
    transitions for the others, too, which a chart does not know.
    """
    wildcards = [key[:-1] for key in KEYS if key.endswith("*") and f'"{key}": [' in text]
    return [
        event
        for event in EVENTS
        if f'"{event}": [' in text or any(f"{event}.".startswith(base) for base in wildcards)
    ] or ["A"]


def answer(name: str, now: int, count: int) -> bool:
    """Return the host's answer for a guard, as the driver computes it."""
    found = 7
    for char in f"{name} {now} {count}":
        found = (found * 31 + ord(char)) % 65521
    return found % 3 != 0


def run_library(jobs: Sequence[Job]) -> list[dict[str, Any]]:
    """Return what the library does, for each job."""
    done = subprocess.run(
        ["node", str(DRIVER), str(NODE_FOLDER)],
        input="".join(json.dumps(job.job) + "\n" for job in jobs),
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def read(job: Job) -> Chart:
    """Return the chart of a job; `FsmkitError` where it is rejected."""
    findings = Findings()
    (name,) = machines(job.source, findings)
    found = import_machine(job.source, name, findings)
    findings.stop_on_errors()
    assert found is not None
    chart = elaborate((found.document,), findings)
    findings.stop_on_errors()
    assert chart is not None
    return chart


def run_chart(chart: Chart, job: Job) -> list[list[str]]:
    """Return what the chart does, in the form of the driver."""
    host = _Host(chart)
    session = Session(chart, host.operations, host.clock, start=False)
    host.session = session
    steps: list[list[str]] = []

    def look() -> None:
        leaves = " ".join(sorted(name.removesuffix("_regions") for name in session.active))
        steps.append([*host.lines, leaves if session.is_running else "done"])
        host.lines = []
        if session.fault is not None:
            raise NeverAtRestError(session.fault)

    session.start()
    session.run()
    look()
    known = {event.name: event for event in chart.events}
    for time, event in job.script:
        while session.is_running and (due := session.next_deadline or time + 1) <= time:
            host.clock.advance(due * 1000 - host.clock.microseconds())
            session.run()
        host.clock.advance(time * 1000 - host.clock.microseconds())
        session.run()
        host.count += 1
        name = next((name for name in _names(event["type"]) if name in known), None)
        if name is not None:
            fields = [field.name for field in known[name].fields]
            session.post(name, **{key: event[key] for key in fields})
            session.run()
        look()
    return steps


def _names(event: str) -> Iterator[str]:
    """Yield the names that an event may have in the chart, the most special first."""
    yield event.replace(".", "_")
    parts = event.split(".")
    for size in range(len(parts), 0, -1):
        yield "_".join((*parts[:size], "other"))
    yield "other"


class NeverAtRestError(Exception):
    """A machine that would take transitions for ever."""


class _Host:
    def __init__(self, chart: Chart) -> None:
        self.clock = SimulatedClock()
        self.count = 0
        self.lines: list[str] = []
        self.session: Session | None = None
        self.operations = {
            operation.name: self._guard(operation.name)
            if operation.name in GUARDS
            else self._action(operation.name)
            for operation in chart.operations
        }

    def _now(self) -> int:
        return self.clock.microseconds() // 1000

    def _guard(self, name: str) -> Any:
        return lambda: answer(name, self._now(), self.count)

    def _action(self, name: str) -> Any:
        def act(*values: object) -> None:
            shown = f" {json.dumps(list(values), separators=(',', ':'))}" if values else ""
            self.lines.append(f"{self._now()} {name}{shown}")

        return act


@dataclass
class Outcome:
    """The result of a comparison: ``rejected`` says why the machine is not carried."""

    job: Job
    rejected: str | None = None
    difference: str | None = None
    events: int = 0


def compare(jobs: Sequence[Job]) -> Iterator[Outcome]:
    """Run jobs both ways."""
    for job, library in zip(jobs, run_library(jobs), strict=True):
        try:
            chart = read(job)
        except FsmkitError as error:
            errors = [one for one in error.diagnostics if one.severity is Severity.ERROR]
            yield Outcome(job, rejected=errors[0].message)
            continue
        if library.get("error"):
            yield Outcome(job, rejected=f"the library: {library['error']}")
            continue
        if {one.name for one in chart.operations} - {*job.job["actions"], *GUARDS}:
            yield Outcome(job, rejected="code of the machine is opaque, so there is no host for it")
            continue
        try:
            own = run_chart(chart, job)
        except NeverAtRestError:
            yield Outcome(job, rejected="the chart never comes to rest")
            continue
        steps = library["steps"][:-1] if library["tie"] else library["steps"]
        difference = None
        for number, step in enumerate(steps):
            if step != own[number]:
                event = job.script[number - 1] if number else "start"
                difference = f"step {number} {event}: library {step}, chart {own[number]}"
                break
        yield Outcome(job, difference=difference, events=len(steps))


def random_jobs(seed: int, count: int, length: int) -> list[Job]:
    """Return random jobs; the same for the same seed."""
    return [random_job(SeededChoices(f"xstate {seed}:{n}"), length) for n in range(count)]
