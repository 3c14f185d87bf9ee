"""Read a campaign file: its runs, and the jobs of each run."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, Text
from fsmkit.document.project.quantities import seconds_of, size_of
from fsmkit.system.any_file import load_any, sources_of
from fsmkit.verify.campaign.jobs import Job
from fsmkit.verify.campaign.keys import CAMPAIGN, ENGINES, FUZZED, LOSSY, RUNS, WITHIN
from fsmkit.verify.mutants.subject import Subject
from fsmkit.verify.resources.time import TIMES
from fsmkit.yaml import nodes
from fsmkit.yaml.encoding import decode
from fsmkit.yaml.fields import Fields

MUTANTS_AT_ONCE, CHARTS_AT_ONCE = 10, 100
"""Limits of one job."""
MOST = 1_000_000
"""Jobs of a campaign, and values of a range: more are a mistake."""
NUMBER = re.compile(r"-?[0-9]{1,18}")
PATTERN = frozenset("*?[")


@dataclass(frozen=True, slots=True)
class Campaign:
    """A name and jobs, in the order of the file; ``runs``: the label of each run."""

    name: str
    runs: tuple[str, ...]
    jobs: tuple[Job, ...]


def read_campaign(path: Path, findings: Findings) -> Campaign:
    """Return the campaign in a file. Raises `FsmkitError` with all findings after an error."""
    source = decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    root = None if source is None else nodes.read_nodes(source, findings)
    whole = nodes.require_mapping(root, "a campaign", findings)
    findings.stop_on_errors()
    if root is None or whole is None:
        findings.add("empty-file", f"`{path}` has no campaign", None)
        raise FsmkitError(findings)
    fields = Fields(whole, CAMPAIGN, "a campaign", findings)
    name = fields.name("campaign")
    if name is None or "runs" not in fields:
        findings.add(
            "broken-campaign", "this is not a campaign", root.span,
            help="name it and its runs: `campaign: night` and `runs: [{check: cell.yaml}]`",
        )  # fmt: skip
        raise FsmkitError(findings)
    reader = _Reader(path.resolve().parent, findings)
    runs: list[str] = []
    jobs: list[Job] = []
    for number, node in enumerate(nodes.items_of(fields.node("runs"), "`runs`", findings)):
        kind, found = reader.run(number, node)
        runs.append(kind)
        jobs += found
        if len(jobs) > MOST:
            findings.add("broken-campaign", f"there are more than {MOST:,} jobs", node.span)
            break
    findings.stop_on_errors()
    if not jobs:
        findings.add("broken-campaign", "the campaign has nothing to do", root.span)
        raise FsmkitError(findings)
    return Campaign(name.value, tuple(runs), tuple(jobs))


@dataclass(frozen=True)
class _Reader:
    """Reads runs; paths of files are relative to ``folder``."""

    folder: Path
    findings: Findings

    def run(self, number: int, node: nodes.Node) -> tuple[str, list[Job]]:
        """Return the kind of a run, and its jobs."""
        mapping = nodes.require_mapping(node, "a run", self.findings)
        if mapping is None:
            return "", []
        kinds = [key for key, _ in mapping.entries if key.value in RUNS]
        if len(kinds) != 1:
            self._wrong(
                "a run does one thing" if kinds else "this kind of run does not exist",
                node, f"its first key must be one of {', '.join(RUNS)}",
            )  # fmt: skip
            return "", []
        kind = kinds[0].value
        fields = Fields(mapping, RUNS[kind], f"a run of `{kind}`", self.findings)
        if kind in WITHIN:
            return kind, list(self._tool(number, kind, kinds[0], fields.node(kind)))
        parameters = self._parameters(kind, fields)
        files = list(self._files(fields.node(kind), kind))
        families = list(self._families(fields.node("set")))
        jobs: list[Job] = []
        for file in files:
            content = self._content(file)
            for family in families:
                jobs += self._of(number, kind, file, {**parameters, "set": family}, content)
        return kind, jobs

    def _of(
        self, number: int, kind: str, file: Path, parameters: dict[str, Any], content: str
    ) -> Iterator[Job]:
        seeds = parameters.pop("seeds", None)
        count = parameters.pop("count", None)
        if kind == "swarm":
            for seed in seeds or range(1, 9):
                yield Job(number, kind, str(file), {**parameters, "seed": seed}, content)
        elif kind == "mutants":
            total = self._changes(file, parameters)
            for first in range(0, min(total, count or total), MUTANTS_AT_ONCE):
                last = min(first + MUTANTS_AT_ONCE, count or total)
                yield Job(
                    number, kind, str(file), {**parameters, "first": first, "last": last}, content
                )
        else:
            yield Job(number, kind, str(file), parameters, content)

    def _changes(self, file: Path, parameters: dict[str, Any]) -> int:
        """Return the number of changes of a file; report its findings if it cannot be read."""
        try:
            subject = Subject.read(file, Findings(), parameters=parameters["set"])
            return len(subject.mutants(subject.documents(), parameters["seed"]))
        except FsmkitError as error:
            self.findings.extend(error.diagnostics)
            return 0

    def _content(self, file: Path) -> str:
        """Return a hash of the sources of a system, as far as it is readable without parameters."""
        try:
            texts = [s.text for s in sources_of(load_any(file, Findings(), None))]
        except FsmkitError:
            texts = [read_bytes(file).decode("utf-8", "replace")]
        return hashlib.sha256("\0".join(texts).encode("utf-8", "replace")).hexdigest()[:16]

    # --- parameters of a run ---------------------------------------------------------------------

    def _parameters(self, kind: str, fields: Fields) -> dict[str, Any]:
        f = fields
        node = f.node("property")
        names = f.texts("property") if isinstance(node, nodes.Sequence) else (f.text("property"),)
        parameters: dict[str, Any] = {
            "properties": [name.value for name in names if name is not None],
            "time": f.one_of("time", {time: time for time in TIMES}),
            "silent": f.flag("silent"),
            "engine": f.one_of("engine", {name: name for name in ENGINES}),
            "timeout": self._quantity(f, "timeout", seconds_of, "60s") or 0.0,
            "memory": self._quantity(f, "memory", size_of, "2G") or 4 << 30,
        }
        if parameters["silent"] and parameters["time"] != "untimed":
            self.findings.add("broken-campaign", "`silent` needs `time: untimed`", f.keys["silent"])
        if kind == "mutants":
            parameters |= {
                "count": self._number(f, "count", 1),
                "seed": self._number(f, "seed", 0) or 0,
            }
        if kind == "swarm":
            parameters["storage"] = f.one_of("storage", {name: name for name in LOSSY})
            parameters["seeds"] = list(self._seeds(f.node("seeds")))
        return parameters

    def _quantity(self, fields: Fields, key: str, read: Any, example: str) -> Any:
        text = fields.text(key)
        found = None if text is None else read(text.value)
        if text is not None and found is None:
            self._value(text, key, f"write for instance `{example}`")
        return found

    def _number(self, fields: Fields, key: str, least: int) -> int | None:
        text = fields.text(key)
        return None if text is None else self._whole(text, key, least)

    def _whole(self, text: Text, key: str, least: int) -> int | None:
        digits = text.value.replace("_", "")
        if digits.isascii() and digits.isdigit() and len(digits) < 19 and int(digits) >= least:
            return int(digits)
        self._value(text, key, f"write a whole number from {least} on")
        return None

    def _seeds(self, node: nodes.Node | None) -> Iterator[int]:
        """Yield the seeds of ``16``, ``1..16`` or ``[1, 2]``."""
        if isinstance(node, nodes.Sequence):
            for text in nodes.texts_of(node, "`seeds`", "a seed", self.findings):
                found = self._whole(text, "seeds", 0)
                yield from () if found is None else (found,)
            return
        given = nodes.require_text(node, "`seeds`", self.findings)
        if given is None:
            return
        values = _range_of(given.value)
        if values is not None:
            yield from map(int, values)
        elif (count := self._whole(given, "seeds", 1)) is not None:
            yield from range(1, min(count, MOST) + 1)

    def _families(self, node: nodes.Node | None) -> Iterator[dict[str, str]]:
        """Yield each combination of the values of parameters."""
        names: list[str] = []
        values: list[list[str]] = []
        mapping = nodes.require_mapping(node, "`set`", self.findings)
        total = 1
        for name, value in () if mapping is None else mapping.entries:
            names.append(name.value.strip())
            values.append(self._values(name, value))
            total *= len(values[-1])
        if total > MOST:
            assert node is not None  # noqa: S101  (it has values)
            self._wrong(f"`set` has {total:,} combinations", node, f"the maximum is {MOST:,}")
            return
        for combination in product(*values):
            yield dict(zip(names, combination, strict=True))

    def _values(self, name: Text, node: nodes.Node) -> list[str]:
        if isinstance(node, nodes.Sequence):
            texts = nodes.texts_of(node, f"`{name.value}`", "a value", self.findings)
            return [text.value for text in texts]
        text = nodes.require_text(node, f"`{name.value}`", self.findings)
        if text is None or not text.value:
            self._value(name, name.value, "give it a value, or a list of values")
            return []
        values = _range_of(text.value)
        return [text.value] if values is None else values

    def _files(self, node: nodes.Node | None, kind: str) -> Iterator[Path]:
        """Yield the files of a path, a pattern, or a list of both."""
        if isinstance(node, nodes.Sequence):
            texts = list(nodes.texts_of(node, f"`{kind}`", "a path", self.findings))
        else:
            text = nodes.require_text(node, f"`{kind}`", self.findings)
            texts = [] if text is None else [text]
        for text in texts:
            found = self._named(text.value)
            if not found:
                self.findings.add(
                    "unreadable-file", f"there is no file `{text.value}`", text,
                    help=f"paths and patterns are relative to `{self.folder}`",
                )  # fmt: skip
            yield from found

    def _named(self, name: str) -> list[Path]:
        try:
            if not PATTERN.intersection(name):
                path = self.folder / name
                return [path.resolve()] if name and path.is_file() else []
            return sorted(path.resolve() for path in self.folder.glob(name) if path.is_file())
        except (OSError, ValueError, NotImplementedError):  # no path at all, or an absolute pattern
            return []

    # --- comparisons, available only where fsmkit is developed ---------------------------------

    def _tool(self, number: int, kind: str, at: Text, node: nodes.Node | None) -> Iterator[Job]:
        mapping = nodes.require_mapping(node, f"`{kind}`", self.findings)
        if not is_checkout():
            self.findings.add(
                "broken-campaign",
                f"`{kind}` belongs to the development tools of fsmkit, which are not installed", at,
                help="run the campaign in a clone of its repository, or remove this run",
            )  # fmt: skip
        if mapping is None:
            return
        fields = Fields(mapping, WITHIN[kind], f"`{kind}`", self.findings)
        seed = self._number(fields, "seed", 0) or 0
        if kind == "fuzz":
            target = fields.one_of("target", {name: name for name in FUZZED})
            seconds = self._number(fields, "seconds", 1) or 60
            yield Job(number, kind, target, {"seconds": seconds, "seed": seed or 1})
            return
        charts = min(self._number(fields, "charts", 1) or 1000, MOST)
        targets = fields.prose("targets")
        for first in range(0, charts, CHARTS_AT_ONCE):
            count = min(CHARTS_AT_ONCE, charts - first)
            parameters = {"seed": seed, "first": first, "charts": count, "targets": targets}
            yield Job(number, kind, "random charts", parameters)

    def _value(self, text: Text, key: str, advice: str) -> None:
        message = f"`{key}` cannot be `{text.value}`"
        self.findings.add("unexpected-value", message, text, help=advice)

    def _wrong(self, message: str, node: nodes.Node, advice: str) -> None:
        self.findings.add("broken-campaign", message, node.span, help=advice)


def is_checkout() -> bool:
    """Return whether the development tools are present, which are not installed with fsmkit."""
    return find_spec("devtools") is not None and find_spec("devtools.differential") is not None


def _range_of(text: str) -> list[str] | None:
    """Return the numbers of ``1..8``; None of another text."""
    first, dots, last = text.partition("..")
    if not dots or not (NUMBER.fullmatch(first.strip()) and NUMBER.fullmatch(last.strip())):
        return None
    begin, end = int(first), int(last)
    return [str(n) for n in range(begin, end + 1)] if 0 <= end - begin < MOST else None
