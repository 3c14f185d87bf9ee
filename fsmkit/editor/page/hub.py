"""The hub of `fsmkit edit`: a session that runs the chart while a client edits it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.positions.placement import (
    Placement,
    hints_path,
    hints_text,
    read_hints,
    renamed,
)
from fsmkit.chart.drawing.states.boxes import composites, opening_folds
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import base_documents
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Severity, Source
from fsmkit.diagnostics.as_json import as_json, location
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.document import keys
from fsmkit.document.document import (
    HISTORIES,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.document.keys import Form, Keys
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import read
from fsmkit.editor.editing.clipboard import copied
from fsmkit.editor.editing.documents import all_states, state_of, transition_of
from fsmkit.editor.editing.session import EditSession, read_operation, write_atomically
from fsmkit.editor.editing.values import LISTS
from fsmkit.editor.editing.yaml_tree import plain
from fsmkit.editor.page.labels import PLACES, completions
from fsmkit.inspector.commands import id_of, wrong
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.simulation import Moment
from fsmkit.inspector.sources.counterexample import recording_of
from fsmkit.inspector.system_at import Course
from fsmkit.runtime.live.messages import Done, Refused, encoded, to_json
from fsmkit.system.views.drawing import draw_kept
from fsmkit.yaml.writer import declarations
from fsmkit.yaml.writing import WRITE, data

Json = dict[str, Any]
QUERIES = ("copy", "complete", "preview", "dependents")
"""Commands of the editor that change nothing."""
EDITING = ("edit", "undo", "redo", "tidy", "trace", *QUERIES)
"""The commands of the editor; all others are those of a session."""
VALID = ("post", "set", "returns", "change", "run", "step")
"""Commands that need a chart without errors."""
NOTHING = "chart: Chart\nstates: {none: {}}\n"
"""The drawn chart of a file without states; the page hides it."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict of `check` on a property.

    ``trace``: its counterexample or witness, from which `recording_of` performs it again.
    """

    name: str
    result: str
    words: str
    text: str = ""
    trace: Json | None = None


class EditHub(Hub):
    """A session of a chart file that is edited.

    The session runs the last chart that was read without an error. While the file has errors, the
    page draws the states and transitions without guards and statements, and nothing runs.
    """

    def __init__(self, editing: EditSession, **options: Any) -> None:
        self.editing = editing
        self.verdicts: list[Verdict] = []
        self.traced = ""
        """The property whose trace is in view, instead of a run of the chart."""
        self._document: Document | None = None
        self._findings: tuple[Diagnostic, ...] = ()
        self.is_valid = False
        self.placement: Placement | None = read_hints(editing.path)
        """The positions of the last drawing, which the next one keeps."""
        self._saved = self.placement
        self._folded: frozenset[str] | None = None
        """The folded states of the last drawing; None before the first."""
        self._is_tidied = False
        super().__init__(self._read(), file=editing.path, **options)
        self._set_drawing(self.view.course)

    # --- charts -------------------------------------------------------------------------------

    def _read(self) -> Chart:
        """Return the chart of the present text, or what can be drawn of it."""
        found = _elaborated(self.editing.source)
        self._document, self._findings, chart = found.document, found.findings, found.chart
        self.is_valid = chart is not None
        if chart is None and self._document is not None:
            chart = _drawable(self._document)
        if chart is None:
            chart = getattr(self, "_last", None) or _drawable(read(Source("none", NOTHING)))
        if chart is None:
            raise TypeError("a chart of one state can be drawn")
        self._last = chart
        return chart

    def changed(self) -> None:
        """Show the present text to all clients, and run its chart."""
        self.verdicts = []
        chart = self._read()
        if self.traced:
            self.traced = ""
            self.show(chart)
        else:
            self.reload(chart)

    def _show(self, course: Course, start: Moment | None, end: Sequence[Json] = ()) -> None:
        super()._show(course, start, end)
        self._set_drawing(course)

    def _set_drawing(self, course: Course) -> None:
        course.encoder.drawn = self._draw
        course.encoder.opening = self._opening

    def _opening(self, chart: Chart) -> frozenset[int]:
        """Return the states that stay folded after an edit."""
        if self._folded is None:
            return opening_folds(chart)
        return frozenset(i for i in composites(chart) if chart.states[i].id in self._folded)

    def _draw(self, chart: Chart, fold: frozenset[int]) -> str:
        """Draw a chart; states that stay keep their positions."""
        svg, self.placement = draw_kept(chart, self.placement, fold=fold)
        self._folded = frozenset(chart.states[state].id for state in fold)
        return svg

    def save_hints(self) -> None:
        """Write the positions of an edited chart beside it; what cannot be written is lost."""
        is_changed = self.editing.is_edited or self._is_tidied
        if self.placement is None or self.placement is self._saved or not is_changed:
            return
        self._saved = self.placement
        path = hints_path(self.editing.path)
        if not path.is_symlink():
            with suppress(OSError):
                write_atomically(path, hints_text(self.placement).encode())

    def show_trace(self, name: str) -> None:
        """Show the trace of a property from its start; with no name, run the chart again."""
        traces = {one.name: one.trace for one in self.verdicts if one.trace is not None}
        if name:
            trace = traces.get(name)
            if trace is None:
                raise wrong(f"the check found no trace of `{name}`", "wait for the next check")
            found = recording_of({"property": name, **trace})
            self.traced = name
            self.show(found)
        elif self.traced:
            self.traced = ""
            self.show(self._last)

    def show_verdicts(self, verdicts: list[Verdict]) -> None:
        """Show the verdicts of a check of the present text."""
        self.verdicts = verdicts
        self.view.clients.send([encoded(self.document())])

    # --- clients ------------------------------------------------------------------------------

    def welcome(self, client: int) -> None:
        """Send a client the whole state, and the document."""
        super().welcome(client)
        self.view.clients[client].send(encoded(self.document()))

    def receive(self, client: int, text: str | bytes) -> None:
        """Execute or reject a command of a client, and respond."""
        try:
            fields = parse_json(text)
        except ValueError:
            fields = {}
        name = fields.get("do") if isinstance(fields, dict) else None
        if name == "chart" and fields.get("chart") not in self.view.course.encoder.hashes:
            # the client requested a chart that was edited meanwhile
            self.view.clients[client].send(to_json(Done(re=id_of(text), result=None)))
            return
        if name not in EDITING and (self.is_valid or name not in VALID):
            super().receive(client, text)
            return
        one, number = self.view.clients[client], id_of(text)
        try:
            if not one.may_command and name not in QUERIES:
                raise wrong("this session is read-only", "start it without `--read-only`")
            if name not in EDITING:
                raise wrong("the chart has errors and cannot run", "correct its findings first")
            result = self._obeyed(str(name), fields)
        except FsmkitError as error:
            first = error.diagnostics[0]
            refused = Refused(
                re=number, rule=first.rule.name, message=first.message, help=first.help or ""
            )
            one.send(to_json(refused))
            if self.editing.source != getattr(self._document, "source", self.editing.source):
                self.changed()  # another program changed the file meanwhile
            return
        one.send(to_json(Done(re=number, result=result)))
        if name not in (*QUERIES, "trace"):
            self.changed()

    def _obeyed(self, name: str, fields: Json) -> Any:
        """Execute a command of the editor, and return its result."""
        match name:
            case "trace":
                self.show_trace(str(fields.get("property", "")))
            case "copy":
                return self._copied(fields)
            case "complete":
                return self._completed(fields)
            case "preview":
                return self._previewed(fields)
            case "dependents":
                renaming = self.editing.renaming(_renaming(fields))
                return self.editing.other_files(renaming)
            case _:
                self._edit(name, fields)
        return self.editing.hash

    def _copied(self, fields: Json) -> str:
        """Return states and transitions as YAML text."""
        if self._document is None:
            raise wrong("the file cannot be read as a chart", "correct its text first")
        parts: list[DocState | DocTransition] = []
        items = fields.get("items")
        if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
            raise wrong("`items` is a list of states and transitions")
        for item in items:
            name, index = item.get("state"), item.get("index")
            if not isinstance(name, str) or not isinstance(index, int | None):
                raise wrong("an item is a state, or a state and the index of a transition")
            if index is not None:
                parts.append(transition_of(self._document, name, index))
            elif name:
                parts.append(state_of(self._document, name))
        if not parts:
            raise wrong("nothing is selected", "select a state or a transition")
        return copied(self._document, parts)

    def _edit(self, name: str, fields: Json) -> None:
        match name:
            case "undo":
                self.editing.undo()
            case "redo":
                self.editing.redo()
            case "tidy":
                self.placement, self._is_tidied = None, True
            case _:
                operations = _operations(fields)
                files = fields.get("files") or []
                if not isinstance(files, list):
                    raise wrong("`files` is a list of names")
                if files and len(operations) == 1 and isinstance(operations[0], op.RenameSymbol):
                    self.editing.rename(operations[0], [str(file) for file in files])
                else:
                    self.editing.edit(operations, str(fields.get("hash", "")))
                for one in operations:
                    self._keep_places(one)

    def _keep_places(self, operation: op.Operation) -> None:
        """Keep positions and folds through an operation; what gets a new state is unfolded."""
        match operation:
            case op.RenameSymbol(kind="state", name=name, new=new):
                if self.placement is not None:
                    self.placement = renamed(self.placement, name, new)
                if self._folded is not None and name in self._folded:
                    self._folded = self._folded - {name} | {new}
            case op.AddState(parent=parent) | op.MoveState(parent=parent) | op.Paste(parent=parent):
                if self._folded is not None:
                    self._folded -= {parent}
            case _:
                pass

    def _completed(self, fields: Json) -> list[Json] | None:
        """Return the completions of a text in the drawing."""
        what = PLACES.get(str(fields.get("what")))
        events = fields.get("events")
        if what is None or not isinstance(events, list | None):
            raise wrong("there is no such text", f"use one of {', '.join(PLACES)}")
        given = None if events is None else tuple(map(str, events))
        text, state = str(fields.get("text", "")), str(fields.get("state", ""))
        return completions(self.editing.source, what, text, state, given)

    def _previewed(self, fields: Json) -> list[Json]:
        """Return the findings that operations would add."""
        try:
            source = self.editing.preview(_operations(fields), str(fields.get("hash", "")))
            found = _elaborated(source).findings
        except FsmkitError as error:
            found = error.diagnostics
        known = {(one.rule.name, one.message) for one in self._findings}
        new = [one for one in found if (one.rule.name, one.message) not in known]
        return [as_json(one) for one in new if one.severity is not Severity.NOTE]

    # --- the document -------------------------------------------------------------------------

    def document(self) -> Json:
        """Return the message that describes the file and its editable items."""
        editing, document = self.editing, self._document
        found: Json = {
            "k": "document",
            "hash": editing.hash,
            "file": str(editing.path),
            "text": editing.text,
            "undo": editing.can_undo,
            "redo": editing.can_redo,
            "valid": self.is_valid,
            "read": document is not None,
            "findings": [as_json(finding) for finding in self._findings],
            "traced": self.traced,
            "verdicts": [
                {
                    "name": one.name,
                    "result": one.result,
                    "words": one.words,
                    "text": one.text,
                    "traced": one.trace is not None,
                }
                for one in self.verdicts
            ],
        }
        if document is None:
            return found
        states = list(all_states(document))
        drawn = {(t.span.source.name, t.span.start): t.index for t in self._last.transitions}
        parents = {id(c): s for s in (document.root, *states) for c in s.children}
        return {
            **found,
            "name": document.name.value,
            "extends": None if document.extends is None else document.extends.value,
            "loose": document.datamodel != "fsmkit",
            "initial": _targets(document.root.initial),
            "states": [_state(state, parents.get(id(state)), drawn) for state in states],
            "keys": _values(document, keys.CHART),
            "declared": _declared(document),
            "rows": {
                "chart": _rows(keys.CHART),
                "state": _rows(keys.STATE),
                "transition": _rows(keys.TRANSITION),
            },
        }


def _state(state: DocState, parent: DocState | None, drawn: Mapping[tuple[str, int], int]) -> Json:
    """Return a state; ``drawn``: the numbers of transitions by the places where they start."""
    return {
        "id": "" if state.id is None else state.id.value,
        "at": location(state.span),
        "kind": state.kind.value,
        "parent": None if parent is None or parent.id is None else parent.id.value,
        "refines": parent is None,
        "children": len(state.children),
        "initial": _targets(state.initial),
        "use": None if state.use is None or state.use.chart is None else state.use.chart.value,
        "keys": _values(state, keys.STATE),
        "transitions": [
            {
                "targets": _targets(one),
                "trigger": one.trigger.value,
                "label": " ".join(event.value for event in one.events)
                or ("" if one.delay is None else one.delay.value),
                "at": location(one.span),
                "drawn": drawn.get((one.span.source.name, one.span.start)),
                "keys": _values(one, keys.TRANSITION),
            }
            for one in state.transitions
        ],
    }


@dataclass(frozen=True, slots=True)
class _Elaborated:
    """The document and the chart of a source, as far as they can be read, and its findings."""

    document: Document | None
    chart: Chart | None
    findings: tuple[Diagnostic, ...]


def _elaborated(source: Source) -> _Elaborated:
    """Return the document and the chart of a source, as far as it has no errors."""
    findings = Findings()
    document = None
    try:
        document = read(source)
        chart = elaborate((document, *base_documents(document, findings)), findings)
    except FsmkitError as error:
        return _Elaborated(document, None, error.diagnostics)
    return _Elaborated(document, chart, tuple(findings))


def _operations(fields: Json) -> list[op.Operation]:
    given = fields.get("operations")
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        raise wrong("`operations` is a list of operations")
    return [read_operation(one) for one in given]


def _renaming(fields: Json) -> op.RenameSymbol:
    (operation, *more) = [*_operations(fields), None]
    if not isinstance(operation, op.RenameSymbol) or more != [None]:
        raise wrong("only one renaming has dependents")
    return operation


def _targets(one: DocTransition | None) -> list[str]:
    return [] if one is None else [target.value for target in one.targets]


def _values(part: Any, rows: Keys) -> dict[str, list[str]]:
    """Return the values of keys as texts: one, or those of a list."""
    found: dict[str, list[str]] = {}
    for row in rows.values():
        if row.form in WRITE and row.is_given(part):
            value = plain(WRITE[row.form](getattr(part, row.field), row))
            match value:
                case dict():
                    found[row.name] = [f"{name}: {text}" for name, text in value.items()]
                case list():
                    found[row.name] = [str(one) for one in value]
                case _:
                    found[row.name] = [str(value).rstrip("\n")]
    return found


def _rows(rows: Keys) -> list[Json]:
    """Return the keys that a form can set."""
    return [
        {
            "name": row.name,
            "doc": row.doc,
            "form": row.form.name.lower(),
            "many": row.form in (*LISTS, Form.ARGUMENTS, Form.DATA),
            "choices": list(row.choices),
        }
        for row in rows.values()
        if row.form is not Form.OWN
        and row.name not in ("target", "override", "inputs", "outputs")
        and (rows is not keys.CHART or row.name != "data")
    ]


def _declared(document: Document) -> dict[str, list[list[str]]]:
    """Return the declarations of each section: names with values."""
    tree: dict[str, Any] = {key: plain(value) for key, value in declarations(document).items()}
    for key in ("data", "inputs", "outputs"):
        tree[key] = plain(dict(data(getattr(document, key))))
    events = tree.get("events", {})
    for group in events if isinstance(events, list) else [events]:
        for direction, names in group.items():
            tree[direction] = [*tree.get(direction, []), *names]
    found: dict[str, list[list[str]]] = {}
    for section in op.SECTIONS:
        if section in ("entries", "properties"):
            continue
        match tree.get(section, []):
            case dict() as pairs:
                found[section] = [[name, _shown(value)] for name, value in pairs.items()]
            case items:
                found[section] = [[_shown(item), ""] for item in items]
    return found


def _shown(value: object) -> str:
    match value:
        case dict():
            return f"{{{', '.join(f'{name}: {one}' for name, one in value.items())}}}"
        case list():
            return f"[{', '.join(map(str, value))}]"
        case _:
            return str(value)


# --- what can be drawn ----------------------------------------------------------------------------


def _drawable(document: Document) -> Chart | None:
    """Return a chart with the states and transitions of a document that has errors."""
    if document.extends is not None:
        return None
    known = frozenset(s.id.value for s in all_states(document) if s.id is not None)
    root = _sketched(document.root, known)
    if not root.children:
        root = replace(root, children=read(Source("none", NOTHING)).root.children)
    bare = Document(source=document.source, name=document.name, root=root, datamodel="ecmascript")
    for one in (bare, replace(bare, root=_without_transitions(root))):
        findings = Findings()
        try:
            chart = elaborate((one,), findings)
        except FsmkitError:
            continue
        if chart is not None:
            return chart
    return None


def _sketched(state: DocState, known: frozenset[str]) -> DocState:
    children = tuple(_sketched(child, known) for child in state.children if child.id is not None)
    kind = state.kind
    if kind in (Kind.CHOICE, *HISTORIES) or (not children and kind is not Kind.FINAL):
        kind = Kind.ATOMIC
    if state.id is None:
        kind = Kind.COMPOUND
    inside = _ids(children)
    initial = state.initial
    if initial is not None and not {t.value for t in initial.targets} <= inside:
        initial = None
    if initial is not None:
        initial = replace(initial, content=None) if kind is Kind.COMPOUND else None
    transitions = () if kind is Kind.FINAL else _bare(state.transitions, known)
    return DocState(
        state.id, kind, state.span, initial=initial, children=children, transitions=transitions
    )


def _ids(states: Iterable[DocState]) -> set[str]:
    found: set[str] = set()
    for state in states:
        found |= {state.id.value} if state.id is not None else set()
        found |= _ids(state.children)
    return found


def _bare(
    transitions: tuple[DocTransition, ...], known: frozenset[str]
) -> tuple[DocTransition, ...]:
    return tuple(
        DocTransition(
            one.trigger if one.trigger is not Trigger.SOMETIMES else Trigger.EVENTLESS,
            one.span,
            events=one.events,
            delay=one.delay,
            targets=tuple(target for target in one.targets if target.value in known),
        )
        for one in transitions
    )


def _without_transitions(state: DocState) -> DocState:
    children = tuple(_without_transitions(child) for child in state.children)
    return replace(state, children=children, transitions=())


def new_text(path: Path) -> str:
    """Return the text of a new file, a chart without states, in the notation of its suffix."""
    stem = "".join(part.capitalize() for part in path.stem.replace("-", "_").split("_"))
    name = stem if stem.isidentifier() else "Chart"
    if path.suffix.lower() in (".scxml", ".xml"):
        return (
            '<?xml version="1.0" encoding="UTF-8"?>\n'
            '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" '
            f'version="1.0" name="{name}" datamodel="fsmkit">\n</scxml>\n'
        )
    return f"chart: {name}\n"
