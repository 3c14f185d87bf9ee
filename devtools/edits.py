"""The laws of edits on random charts: ``python -m devtools.edits --charts 1000 --seed 1``.

Each chart is written in YAML and SCXML, its layout is spoilt, and comments are put between its
lines. Random operations are applied one after the other. After each of them the text must read as
the Document that the operation gives, keep all comments but those of removed items, keep the
text of untouched items, and come back byte for byte when the edits are inverted. An operation
that the Document accepts must apply to the text.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import click

from devtools.formatting import spoilt_xml, spoilt_yaml
from devtools.random_charts.charts import random_document, random_family
from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.diagnostics import FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.document import keys
from fsmkit.document.document import DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.keys import Form
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import REMOVING, apply, inverted, read
from fsmkit.editor.editing.clipboard import copied
from fsmkit.editor.editing.documents import all_states, transformed
from fsmkit.editor.editing.xml_edits import XmlFile, xml_remarks
from fsmkit.editor.editing.yaml_edits import located_states
from fsmkit.editor.formatting.concrete import remarks
from fsmkit.scxml.writer import write_document as write_scxml
from fsmkit.yaml.writer import write_document as write_yaml

NAMES = ("fresh", "n.m", "other", "a b", "", "Großes", "true", "on", "main.main")
GUARDS = ("1 < 2", "", 'x == "a: b"', "[1, 2][0] > 0", "true # no comment", "{x}", "in(fresh)")
STATEMENTS = (
    "",
    "log(1)",
    'log("a, b: c")',
    "if 1 < 2 { log(1) }\nlog(2)",
    "@@ broken",
    "cancel s",
)
LABELS = ("go", "go stop", "stop", "", "*", "error.*", "a, b")
DELAYS = ("5s", "100ms", "", "1m")
TEXTS = (
    "hello", "chart: X", "a: b", "{", "states: [x]", "- 3", "on: {go: x}", "x:\n  on: {go: x}",
    "transitions: [{after: 5s, target: x}]", "states: {pasted: {}}\ntransitions: [{always: true}]",
)  # fmt: skip
DOCS = ("", "A word", "It is: long, and has # signs.", "two\nlines", "'quoted' \"text\"")
DECLARED = (
    ("constants", "K", "5"), ("constants", "SPEED", "2 * 3"), ("data", "extra", "0..9 = 0"),
    ("inputs", "seen", "bool"), ("outputs", "lamp", "bool = false"), ("in", "poke(n 0..3)", ""),
    ("internal", "tick", ""), ("out", "done_it", ""), ("operations", "beep(n 0..9)", ""),
    ("functions", "twice(n 0..9) -> int", "2 * n"), ("types", "Colour", "[red, green]"),
    ("types", "Point", "{x: 0..9, y: 0..9}"), ("types", "Small", "0..3"), ("in", "@ bad", ""),
    ("properties", "safe", "invariant: 1 < 2"), ("properties", "free", "deadlock_free"),
)  # fmt: skip


def random_operation(choices: Choices, document: Document) -> op.Operation:
    """Return a random operation, which need not fit the chart."""
    states = [s for s in all_states(document) if s.id is not None]
    ids = [s.id.value for s in states if s.id is not None]

    def state() -> str:
        return choices.pick(ids) if ids and not choices.chance(3) else choices.pick(("", "gone"))

    def several() -> tuple[str, ...]:
        if choices.chance(10) or not ids:
            return ()
        return choices.some(ids, 1 if choices.chance(80) else 2)

    def name() -> str:
        if choices.chance(80):
            return f"new{choices.integer(1, 99)}"
        return choices.pick((*NAMES, *ids[:2]))

    def transition() -> tuple[str, int]:
        found = [(s.id.value, n) for s in states if s.id for n in range(len(s.transitions))]
        return choices.pick(found) if found and not choices.chance(3) else (state(), 7)

    def trigger() -> tuple[Trigger, str]:
        kind = choices.pick([t for t in Trigger if t is not Trigger.INITIAL])
        if kind is Trigger.EVENT:
            return kind, choices.pick(LABELS)
        return kind, choices.pick(DELAYS) if kind in (Trigger.AFTER, Trigger.EVERY) else ""

    def before(parent: str) -> str | None:
        inside = next((s.children for s in states if s.id and s.id.value == parent), ())
        inside = document.root.children if not parent else inside
        named = [s.id.value for s in inside if s.id is not None]
        return choices.pick(named) if named and choices.chance(50) else None

    def key() -> op.Operation:
        where, index = state(), None
        rows = keys.STATE
        if choices.chance(40):
            (where, index), rows = transition(), keys.TRANSITION
        elif choices.chance(20):
            where, rows = op.CHART, keys.CHART
        row = choices.pick([r for r in rows.values() if r.form is not Form.OWN])
        return op.SetKey(where, row.name, random_value(choices, row, ids), index)

    def declaration() -> op.Operation:
        fields = ("constants", "data", "inputs", "operations", "functions", "types", "events")
        found = [(f, one) for f in fields for one in getattr(document, f)]
        if not found:
            return op.RemoveDeclaration("data", "gone")
        section, one = choices.pick(found)
        section = one.direction.value if section == "events" else section
        return op.RemoveDeclaration(section, one.name.value)

    parent = choices.pick((op.CHART, *ids))
    number = choices.integer(0, 20)
    match number:
        case 0 if choices.chance(50):
            found: list[DocState | DocTransition] = [*states]
            found += [one for source in states for one in source.transitions]
            if not found or choices.chance(20):
                return op.Paste(parent, choices.pick((*TEXTS, "")))
            return op.Paste(parent, copied(document, choices.some(found, 2)))
        case 0 | 1:
            return op.AddState(parent, name(), choices.pick(list(Kind)), before(parent))
        case 2:
            return op.RemoveState(state())
        case 3:
            return op.MoveState(state(), parent, before(parent))
        case 4:
            return op.SetInitial(state(), several())
        case 5:
            return op.SetKind(state(), choices.pick(list(Kind)))
        case 6 | 7:
            kind, label = trigger()
            guard, content = choices.pick(GUARDS), choices.pick(STATEMENTS)
            return op.AddTransition(state(), several(), kind, label, guard, content)
        case 8:
            return op.RemoveTransition(*transition())
        case 9:
            return op.SetSource(*transition(), state())
        case 10:
            return op.SetTarget(*transition(), several())
        case 11:
            return op.SetTrigger(*transition(), *trigger())
        case 12:
            return op.SetDelay(*transition(), choices.pick(DELAYS))
        case 13:
            return op.SetGuard(*transition(), choices.pick(GUARDS))
        case 14:
            return op.SetContent(*transition(), choices.pick(STATEMENTS))
        case 15:
            return op.MoveTransition(*transition(), choices.integer(0, 3))
        case 16:
            handlers = tuple(choices.pick(STATEMENTS) for _ in range(choices.integer(0, 2)))
            return op.SetHandler(state(), choices.pick(("entry", "exit")), handlers)
        case 17:
            return key()
        case 18:
            return op.Declare(*choices.pick(DECLARED))
        case 19:
            return declaration()
        case _:
            plain = [
                s.id.value
                for s in states
                if s.id and s.kind is Kind.COMPOUND and s.children and not s.transitions
            ]
            if choices.chance(50):
                return op.UnwrapState(choices.pick(plain) if plain else state())
            if document.extends is not None and choices.chance(50):
                return op.OverrideState(choices.pick((*NAMES, "inherited")))
            siblings = next((s.children for s in states if s.id and s.id.value == parent), ())
            siblings = document.root.children if not parent else siblings
            named = [s.id.value for s in siblings if s.id is not None]
            return op.WrapInState(choices.some(named, 3) if named else several(), name())


def random_value(choices: Choices, row: keys.Key, ids: list[str]) -> tuple[str, ...]:
    """Return a random value of a key."""
    if choices.chance(20):
        return ()
    match row.form:
        case Form.PROSE:
            return (choices.pick(DOCS),)
        case Form.FLAG:
            return (choices.pick(("true", "false", "maybe")),)
        case Form.CHOICE | Form.MARKS:
            return (choices.pick([*row.choices]),)
        case Form.NAMES | Form.TARGETS | Form.IDS:
            return choices.some(ids or ["one"], 2)
        case Form.STATEMENTS:
            return (choices.pick(STATEMENTS),)
        case Form.HANDLERS:
            return tuple(choices.pick(STATEMENTS) for _ in range(choices.integer(1, 2)))
        case Form.ARGUMENTS | Form.DATA:
            return (f"v{choices.integer(1, 9)}: 0..9 = 1", "w: bool = true")
        case _:
            return (choices.pick(("word", "1 < 2", "a: b")),)


# --- laws -----------------------------------------------------------------------------------------


@dataclass
class Tally:
    """Counts of operations, and the problems found."""

    applied: Counter[str] = field(default_factory=Counter)
    rejected: Counter[str] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)


def checked(source: Source, operation: op.Operation, tally: Tally) -> Source:
    """Apply an operation, check the laws, and return the new source."""
    name = type(operation).__name__
    old = read(source)
    try:
        new = transformed(old, operation)
    except FsmkitError:
        tally.rejected[name] += 1
        try:
            apply(source, operation)
        except FsmkitError:
            return source
        raise AssertionError("the text accepts what the Document rejects") from None
    started = time.perf_counter()
    try:
        edits = apply(source, operation)
    except FsmkitError as error:
        if any(finding.rule.name == "not-expressible" for finding in error.diagnostics):
            tally.rejected[name] += 1
            return source
        raise
    tally.seconds.append(time.perf_counter() - started)
    result = Source(source.name, apply_edits(source.text, edits))
    if read(result) != new:
        raise AssertionError("another meaning")
    if apply_edits(result.text, inverted(source, edits)) != source.text:
        raise AssertionError("no inverse")
    find = xml_remarks if is_xml(source) else remarks
    before, after = Counter(find(source)), Counter(find(result))
    if after - before or (not isinstance(operation, REMOVING) and before != after):
        raise AssertionError("a comment is lost or repeated")
    for text in untouched(source, old, new):
        if text not in result.text:
            raise AssertionError(f"an untouched state changed:\n{text}")
    tally.applied[name] += 1
    tally.lines.append(
        max((e.text.count("\n") for e in edits), default=0)
        if len(edits) < 2
        else sum(max(e.text.count("\n"), 1) for e in edits)
    )
    return result


def untouched(source: Source, old: Document, new: Document) -> Iterator[str]:
    """Yield the texts of the states that an operation leaves as they are, where they are."""
    paths = {id(state): path for state, path in _paths(new)}
    texts = {id(state): text for state, text in _texts(source, old)}
    for state, path in _paths(old):
        if paths.get(id(state)) == path and id(state) in texts:
            yield texts[id(state)]


def _paths(document: Document) -> Iterator[tuple[DocState, tuple[int, ...]]]:
    """Yield the states with the states around them."""
    outer = (*document.root.children, *document.refine)
    pending: list[tuple[DocState, tuple[int, ...]]] = [(state, ()) for state in outer]
    while pending:
        state, path = pending.pop()
        yield state, path
        pending += [(child, (*path, id(state.span))) for child in state.children]


def _texts(source: Source, document: Document) -> Iterator[tuple[DocState, str]]:
    if is_xml(source):
        yield from XmlFile(source, document).texts()
    else:
        yield from located_states(source, document)


def sources(seed: int | str) -> Iterator[Source]:
    """Yield a random chart in both notations, with comments."""
    choices = SeededChoices(f"edits {seed}")
    if choices.chance(15):
        document = random_family(choices)[0]
    else:
        document = random_document(choices, 14, has_functions=choices.chance(30))
    for name, write, spoil in (
        ("a.yaml", write_yaml, spoilt_yaml),
        ("a.scxml", write_scxml, spoilt_xml),
    ):
        try:
            text = write(document)
        except FsmkitError:  # one of the notations cannot express it
            continue
        yield Source(name, spoil(text, choices) if choices.chance(80) else text)


def run(source: Source, seed: str, count: int, tally: Tally) -> None:
    """Apply so many random operations to a source."""
    choices = SeededChoices(seed)
    for number in range(count):
        document = read(source)
        operation = random_operation(choices, document)
        try:
            source = checked(source, operation, tally)
        except Exception as error:  # noqa: BLE001  (every exception is a finding of this tool)
            tally.problems.append(
                f"{source.name} {seed} step {number}: {operation}: {type(error).__name__}: {error}"
            )


@click.command()
@click.option("--charts", default=100, help="Random charts.")
@click.option("--seed", default=0, help="The first seed.")
@click.option("--operations", default=20, help="Operations on each chart and notation.")
@click.option("--folder", type=click.Path(path_type=Path), help="Edit the charts of a folder.")
@click.option("--notation", default="", help="Only `yaml` or `scxml`.")
@click.option("--show", default=5, help="Problems that are printed.")
def main(
    charts: int, seed: int, operations: int, folder: Path | None, notation: str, show: int
) -> None:
    """Check the laws of edits."""
    tally = Tally()
    if folder is not None:
        for path in sorted(folder.rglob("*.yaml")) + sorted(folder.rglob("*.scxml")):
            source = Source(str(path), path.read_text())
            try:
                read(source)
            except FsmkitError:
                continue
            run(source, f"{seed} {path.name}", operations, tally)
    else:
        for number in range(seed, seed + charts):
            for source in sources(number):
                if notation and not source.name.endswith(notation):
                    continue
                run(source, f"{number}", operations, tally)
    total = sum(tally.applied.values())
    lines = sorted(tally.lines) or [0]
    seconds = sorted(tally.seconds) or [0.0]
    out = sys.stdout.write
    for problem in tally.problems[:show]:
        out(f"{problem}\n")
    for name in sorted({*tally.applied, *tally.rejected}):
        out(f"{name:18} {tally.applied[name]:6} applied {tally.rejected[name]:6} rejected\n")
    out(
        f"{total} applied, {sum(tally.rejected.values())} rejected, "
        f"{len(tally.problems)} problems; "
        f"lines changed: median {lines[len(lines) // 2]}; "
        f"{1000 * seconds[len(seconds) // 2]:.0f} ms for an operation\n"
    )
    sys.exit(bool(tally.problems))


if __name__ == "__main__":
    main()
