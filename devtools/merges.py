"""Three-way merges of random charts: ``python -m devtools.merges --triples 500 --seed 1``.

A random chart is changed by two lists of random operations. The merge of both must have the
meaning of all operations, in one order of the lists or the other, or it must report a conflict.
The order of transitions that may be enabled at once is a part of the meaning.
Its text must read as that meaning and keep the comments. Where the operations of one list do not
fit the chart that the other list gave, a conflict must be reported.
"""

from __future__ import annotations

import itertools
import re
import sys
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any

import click

from devtools.edits import random_operation, sources
from devtools.random_charts.choices import Choices, SeededChoices
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.merging.documents import merged
from fsmkit.chart.merging.transitions import can_compete, comparable
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.document.document import DocState, Document
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, read
from fsmkit.editor.editing.documents import all_states, transformed
from fsmkit.editor.editing.merging import Checked, merge_texts, wanted_remarks
from fsmkit.editor.editing.xml_edits import xml_remarks
from fsmkit.editor.formatting.concrete import remarks
from fsmkit.scxml.writer import write_document as write_scxml
from fsmkit.yaml.writer import write_document as write_yaml

MOST_OPERATIONS = 4


@dataclass
class Tally:
    """Counts of triples, and the problems found."""

    merged: int = 0
    renamed: int = 0
    """Merges with a state that one version renamed."""
    conflicts: Counter[str] = field(default_factory=Counter)
    needless: Counter[str] = field(default_factory=Counter)
    """Conflicts though the operations fit in both orders with one result."""
    other_order: int = 0
    """Results with another order of transitions that are never enabled at once."""
    problems: list[str] = field(default_factory=list)


class Branch:
    """A version of a chart: a list of operations, applied to its document and its text."""

    def __init__(self, source: Source, base: Document) -> None:
        """Start with the base."""
        self.text = source
        self.document = base
        self.operations: list[tuple[op.Operation, Document, Document]] = []
        """The operations, each with the documents before and after it."""

    def apply(self, operation: op.Operation) -> None:
        """Apply an operation, if the document and the text accept it."""
        try:
            new = transformed(self.document, operation)
            edits = apply(self.text, operation)
        except FsmkitError:
            return
        if new is self.document:
            return
        self.operations.append((operation, self.document, new))
        self.document = new
        self.text = Source(self.text.name, apply_edits(self.text.text, edits))


def replayed(other: Branch, branch: Branch) -> Document | None:
    """Return the result of a branch after the operations of another; None if one does not fit.

    An operation that both have is applied once.

    The transition of an operation is the one with the same location: the operations of both
    branches started from one document, and each replay adds the new ones to `twins`.
    """
    twins: dict[int, int] = {}
    document = other.document
    both = [operation for operation, _, _ in other.operations]
    for operation, before, after in branch.operations:
        if isinstance(operation, op.AddTransition) and operation in both:
            continue  # both added it
        fitted = _fitted(operation, before, document, twins)
        if fitted is None and isinstance(operation, op.RemoveTransition):
            continue  # both removed it
        if fitted is None:
            return None
        try:
            new = transformed(document, fitted)
        except FsmkitError:
            if operation in both:
                continue
            return None
        twins |= _new_twins(before, after, document, new)
        document = new
    return document


def _fitted(
    operation: op.Operation, origin: Document, document: Document, twins: dict[int, int]
) -> op.Operation | None:
    index = getattr(operation, "index", None)
    if index is None:
        return operation
    name = operation.state if isinstance(operation, op.SetKey) else getattr(operation, "source", "")
    state = next(s for s in all_states(origin) if s.id is not None and s.id.value == name)
    span = id(state.transitions[index].span)
    span = twins.get(span, span)
    for one in all_states(document):
        for number, transition in enumerate(one.transitions):
            if id(transition.span) == span and one.id is not None:
                owner = "state" if isinstance(operation, op.SetKey) else "source"
                changes: dict[str, Any] = {owner: one.id.value, "index": number}
                return replace(operation, **changes)
    return None


def _new_twins(before: Document, after: Document, old: Document, new: Document) -> dict[int, int]:
    pairs = []
    for one, other in ((before, after), (old, new)):
        known = {id(t.span) for s in all_states(one) for t in s.transitions}
        pairs.append(
            [
                id(t.span)
                for s in all_states(other)
                for t in s.transitions
                if id(t.span) not in known
            ]
        )
    return dict(zip(*pairs, strict=False))


def check_triple(base: Source, choices: Choices, tally: Tally) -> None:
    """Change a chart in two ways, merge both, and compare."""
    document = read(base)
    branches = Branch(base, document), Branch(base, document)
    for branch in branches:
        for _ in range(choices.integer(1, MOST_OPERATIONS)):
            branch.apply(random_operation(choices, branch.document))
    ours, theirs = branches
    expected = [replayed(ours, theirs), replayed(theirs, ours)]
    merge = merged(document, read(ours.text), read(theirs.text))
    if merge is None:
        tally.conflicts["no ids"] += 1
        return
    if merge.conflicts:
        message = re.sub(r"`[^`]*`", "`_`", merge.conflicts[0].message)
        is_clear = expected[0] is not None and expected[0] == expected[1]
        (tally.needless if is_clear else tally.conflicts)[message] += 1
        return
    if merge.document not in expected:
        found = [one for one in expected if one and _sorted(one) == _sorted(merge.document)]
        if any(_priorities(one) == _priorities(merge.document) for one in found):
            tally.other_order += 1
        else:
            tally.problems.append(
                f"{base.name}: {[o for o, _, _ in ours.operations]} and "
                f"{[o for o, _, _ in theirs.operations]}: another result"
                + ("" if any(expected) else ", though they do not fit")
            )
            return
    tally.merged += 1
    _check_text(base, ours.text, theirs.text, merge.document, tally)
    _check_renamed(base, ours.text, theirs.text, merge.document, tally)


def _sorted(document: Document) -> Document:
    """Return a document with the transitions of each state in one order."""

    def rebuilt(state: DocState) -> DocState:
        transitions = tuple(sorted(state.transitions, key=lambda t: repr(comparable(t))))
        children = tuple(map(rebuilt, state.children))
        return replace(state, transitions=transitions, children=children)

    refine = tuple(map(rebuilt, document.refine))
    return replace(document, root=rebuilt(document.root), refine=refine)


def _priorities(document: Document) -> Counter[tuple[str, ...]]:
    """Return the pairs of transitions whose order has a meaning, in this order."""
    found: Counter[tuple[str, ...]] = Counter()
    for state in all_states(document):
        for one, other in itertools.combinations(state.transitions, 2):
            if can_compete(one, other):
                label = "" if state.id is None else state.id.value
                found[label, repr(comparable(one)), repr(comparable(other))] += 1
    return found


def _check_text(
    base: Source, ours: Source, theirs: Source, expected: Document, tally: Tally
) -> None:
    found = merge_texts(base, ours, theirs, checked)
    if found.conflicts:
        tally.problems.append(f"{base.name}: the text is rejected: {found.conflicts[0].message}")
        return
    result = Source(base.name, found.text)
    if read(result) != expected:
        tally.problems.append(f"{base.name}: the text has another meaning")
    find = xml_remarks if is_xml(base) else remarks
    wanted = wanted_remarks(*(Counter(find(one)) for one in (base, ours, theirs)))
    if lost := wanted - Counter(find(result)):
        tally.problems.append(f"{base.name}: lost comments: {[*lost]}")


def _check_renamed(
    base: Source, ours: Source, theirs: Source, expected: Document, tally: Tally
) -> None:
    """Merge again after the first version renamed a state that all three have."""
    charts = [checked(one.text).chart for one in (base, ours, theirs)]
    write = write_scxml if is_xml(base) else write_yaml
    known = [{s.id.value for s in all_states(read(s_)) if s.id} for s_ in (base, ours, theirs)]
    common = sorted(set.intersection(*known) & {s.id.value for s in all_states(expected) if s.id})
    if None in charts or not common:
        return
    rename = op.RenameSymbol("state", common[0], "renamed")
    try:
        plain = Source(base.name, write(expected))
        result = read(_renamed_text(plain, rename))
        mine = _renamed_text(ours, rename)
    except FsmkitError:
        return
    found = merge_texts(base, mine, theirs, checked)
    if found.conflicts:
        (tally.conflicts)["renamed: " + found.conflicts[0].message[:60]] += 1
    elif read(Source(base.name, found.text)) != result:
        tally.problems.append(f"{base.name}: another result after a rename of {common[0]}")
    else:
        tally.renamed += 1


def _renamed_text(source: Source, rename: op.RenameSymbol) -> Source:
    return Source(source.name, apply_edits(source.text, apply(source, rename)))


def checked(text: str) -> Checked:
    """Return a chart of a text, without its bases and used charts."""
    findings = Findings()
    try:
        chart = elaborate((read(Source("chart", text)),), findings)
    except FsmkitError as error:
        return Checked(error.diagnostics)
    return Checked(tuple(findings), chart)


@click.command()
@click.option("--triples", default=100, help="Random triples.")
@click.option("--seed", default=0, help="The first seed.")
@click.option("--show", default=5, help="Problems that are printed.")
def main(triples: int, seed: int, show: int) -> None:
    """Check merges of random charts."""
    tally = Tally()
    number = 0
    while number < triples:
        for source in sources(f"merge {seed}"):
            check_triple(source, SeededChoices(f"merge {seed} {source.name}"), tally)
            number += 1
        seed += 1
    out = sys.stdout.write
    for problem in tally.problems[:show]:
        out(f"{problem}\n")
    for message, count in tally.conflicts.most_common():
        out(f"{count:5} conflicts: {message}\n")
    for message, count in tally.needless.most_common():
        out(f"{count:5} conflicts of operations that fit: {message}\n")
    out(
        f"{number} triples: {tally.merged} merged, {sum(tally.conflicts.values())} conflicts, "
        f"{sum(tally.needless.values())} conflicts of operations that fit, "
        f"{tally.renamed} merged with a rename, {tally.other_order} in another order, "
        f"{len(tally.problems)} problems\n"
    )
    sys.exit(bool(tally.problems))


if __name__ == "__main__":
    main()
