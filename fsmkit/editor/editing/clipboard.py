"""Parts of a chart as YAML text: what is copied from a chart, and read when it is pasted."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from textwrap import dedent

from fsmkit.diagnostics import Findings, FsmkitError, Severity, Source, Text
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import DocState, DocTransition, Document
from fsmkit.editor.editing.operations import RenameSymbol
from fsmkit.editor.editing.renaming import rename_edits
from fsmkit.editor.editing.values import VALUE, new_text, rejected
from fsmkit.yaml.layout import render
from fsmkit.yaml.nodes import Mapping, Node, Scalar, Sequence, read_nodes
from fsmkit.yaml.reader import document_of
from fsmkit.yaml.state_writer import StateWriter
from fsmkit.yaml.transition_writer import with_trigger
from fsmkit.yaml.writer import chart, write_document

TRANSITIONS = ("on", "after", "every", "always", "sometimes", "transitions")
"""Keys of a state that hold transitions."""
HOLDER = "pasted.transitions"
"""The id of the state that holds pasted transitions while they are read."""
NUMBERED = re.compile(r"(.*?)\d*")


def copied(document: Document, parts: Iterable[DocState | DocTransition]) -> str:
    """Return states and transitions of a chart as YAML text, whatever the notation of its file."""
    given = tuple(parts)
    states = tuple(one for one in given if isinstance(one, DocState))
    moves = [with_trigger(one) for one in given if isinstance(one, DocTransition)]
    tree = {"states": StateWriter(document, chart).states(states, "state")} if states else {}
    return render({**tree, **({"transitions": [*moves]} if moves else {})})


def read_parts(
    document: Document, text: str, taken: Iterable[str]
) -> tuple[tuple[DocState, ...], tuple[DocTransition, ...]]:
    """Return the states and the transitions of a text.

    The text has the keys ``states`` and ``transitions``, or it is copied from a YAML chart:
    states by their names, or transitions such as ``on: {go: b}``. A state with one of the
    ``taken`` names gets a number, and the references inside the text follow.

    Raises:
        FsmkitError: ``edit-rejected`` if the text is not a part of a chart.

    """
    found = _document(document, _parsed(dedent(text.expandtabs())))
    known = set(taken)
    own = {one.id.value for one in _all(found.root.children) if one.id is not None} - {HOLDER}
    for name in sorted(own & known):
        new = _numbered(name, known | own)
        own.add(new)
        source = Source(f"{VALUE}.yaml", write_document(found))
        edits = rename_edits(source, RenameSymbol("state", name, new), is_whole=False)
        findings = Findings()
        root = read_nodes(Source(source.name, apply_edits(source.text, edits)), findings)
        found = _read(root, findings)
    holder = next((s for s in found.root.children if s.id and s.id.value == HOLDER), None)
    states = tuple(one for one in found.root.children if one is not holder)
    transitions = () if holder is None else holder.transitions
    if not states and not transitions:
        raise _wrong("it has no states and no transitions")
    return states, transitions


def _document(document: Document, root: Mapping | Sequence) -> Document:
    """Return a chart with the parts of a text."""
    states: tuple[tuple[Text, Node], ...] = ()
    held: tuple[tuple[Text, Node], ...] = ()
    names = set() if isinstance(root, Sequence) else {key.value for key, _ in root.entries}
    if isinstance(root, Sequence):
        held = ((new_text("transitions"), root),)
    elif names <= set(TRANSITIONS):
        held = root.entries
    elif names <= {"states", "transitions"}:
        held = tuple(entry for entry in root.entries if entry[0].value == "transitions")
        given = next(value for key, value in root.entries if key.value == "states")
        if not isinstance(given, Mapping):
            raise _wrong("`states` is not a mapping of states")
        states = given.entries
    else:
        states = root.entries
    if any(key.value == HOLDER for key, _ in states):
        raise _wrong(f"`{HOLDER}` is reserved")
    if held:
        states = (*states, (new_text(HOLDER), Mapping(held, root.span)))
    entries: tuple[tuple[Text, Node], ...] = (
        (new_text("chart"), Scalar(new_text("Value"))),
        (new_text("datamodel"), Scalar(new_text(document.datamodel))),
        (new_text("states"), Mapping(states, root.span)),
    )
    return _read(Mapping(entries, root.span), Findings())


def _parsed(text: str) -> Mapping | Sequence:
    findings = Findings()
    root = read_nodes(Source(VALUE, text), findings)
    if findings.has_errors or not isinstance(root, Mapping | Sequence):
        raise _wrong(next((f.message for f in findings), "it is neither states nor transitions"))
    return root


def _read(root: Node | None, findings: Findings) -> Document:
    try:
        found = None if root is None else document_of(root, findings)
    except FsmkitError as error:
        raise _wrong(error.diagnostics[0].message) from error
    if found is None or findings.has_errors:
        raise _wrong(next(f.message for f in findings if f.severity is Severity.ERROR))
    return found


def _wrong(reason: str) -> FsmkitError:
    return rejected(
        f"the text is not a part of a chart: {reason}",
        help="copy a state or a transition, in the page or in a YAML chart",
    )


def _all(states: tuple[DocState, ...]) -> Iterator[DocState]:
    for state in states:
        yield state
        yield from _all(state.children)


def _numbered(name: str, taken: set[str]) -> str:
    """Return the first free name with another number."""
    match = NUMBERED.fullmatch(name)
    base = name if match is None else match[1]
    number = 2
    while f"{base}{number}" in taken:
        number += 1
    return f"{base}{number}"
