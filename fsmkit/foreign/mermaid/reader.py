"""Reads state diagrams of Mermaid: Mermaid has no meaning of its own, so labels are read as ours.

A label is ``event [guard] / content``. ``after 2s`` and ``every 2s`` are timers; an arrow without
an event is eventless. Prose is an event of that name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import PurePath

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document import document as doc
from fsmkit.emit.identifiers import Namer, legal
from fsmkit.foreign.content import Content, Operations
from fsmkit.foreign.imports import Import, Recorder, counts, reject
from fsmkit.foreign.mermaid.diagram import Arrow, Diagram, Node, plain, read_diagram
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Block, Raise

LARGEST = 1 << 21
LABEL = re.compile(
    r"(?P<event>[^\[/]*)(?:\[(?P<guard>.*?)\](?=\s*(?:/|$)))?\s*(?:/(?P<content>.*))?$", re.DOTALL
)
TIMER = re.compile(r"(after|every)\s+(?:\w+\s+\()?(\d+(?:\.\d+)?(?:us|ms|s|m|h))\)?$")
HANDLER = re.compile(r"(entry|exit)\s*/\s*(.*)$", re.DOTALL)
RAISE = re.compile(r"\s*raise\s+(\w+)\s*$")
BOX = re.compile(r"(?:entry|exit)\s*/|[^/\[\]]*(?:\[[^\]]*\])?\s*/")
BARS = ("fork", "join")
HISTORIES = {"H": doc.Kind.SHALLOW_HISTORY, "H*": doc.Kind.DEEP_HISTORY}


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the name of the diagram: its title, or the name of the file."""
    if len(source.text) > LARGEST:
        findings.add(
            "foreign-syntax", f"`{source.name}` has more than {LARGEST >> 20} Mi characters",
            Span(source, 0, 1), help="divide the diagram",
        )  # fmt: skip
        return ()
    diagram = read_diagram(source, findings)
    return () if diagram is None else (_name(diagram, source),)


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return the chart of a diagram."""
    diagram = read_diagram(source, Findings())  # `machines` reported what is wrong with it
    if diagram is None:
        return None
    if not diagram.root.children:
        findings.add(
            "foreign-syntax", "the diagram has no states", diagram.root.at, help="draw a state"
        )
        return None
    builder = _Builder(diagram, source, findings)
    document = builder.document(machine)
    for span in diagram.lost:
        builder.recorder.lose("a setting of the drawing", span)
    return builder.recorder.imported(machine, document, counts(document), builder.operations.opaque)


def _name(diagram: Diagram, source: Source) -> str:
    name = diagram.name.value
    return name if name != "Machine" else legal(PurePath(source.name).name.split(".")[0])


@dataclass(frozen=True, slots=True)
class _Label:
    event: Text | None
    guard: Text | None
    content: Text | None


@dataclass
class _Builder:
    diagram: Diagram
    source: Source
    findings: Findings
    recorder: Recorder = field(default_factory=Recorder)
    operations: Operations = field(default_factory=Operations)
    states: Namer = field(default_factory=lambda: Namer(RESERVED))
    ids: dict[str, str] = field(default_factory=dict)
    events: dict[str, Text] = field(default_factory=dict)
    raised: dict[str, Text] = field(default_factory=dict)
    event_names: Namer = field(default_factory=lambda: Namer(RESERVED))
    arrows: dict[str, list[Arrow]] = field(default_factory=dict)
    joins: dict[str, list[doc.DocTransition]] = field(default_factory=dict)
    ends: dict[tuple[str, int], str] = field(default_factory=dict)
    """The final states of scopes, by the key of the scope and the number of the region."""

    def __post_init__(self) -> None:
        self.content = Content(self.operations, {}, self._special)

    def document(self, machine: str) -> doc.Document:
        """Return the document of the diagram."""
        for node in self._walk(self.diagram.root):
            is_ours = re.fullmatch(r"s\d+", node.key) and node.title
            self.ids[node.key] = self.states.name(node.title if is_ours else node.key, "_state")
            if node.key in self.diagram.histories and node.title in HISTORIES:
                node.kind = node.title
        for arrow in self.diagram.arrows:
            self.arrows.setdefault(arrow.source.key, []).append(arrow)
        for node in self._walk(self.diagram.root):
            if node.kind == "join":
                self._join(node)
        root = self.diagram.root
        if len(root.sections) > 1:
            reject(
                self.findings, "the whole diagram has regions", root.at,
                "draw a state around them",
            )  # fmt: skip
        children = self._children(root, 0)
        initial = self._initial(root, 0)
        if initial is None:
            first = next((child for child in root.children if self._is_plain(child)), None)
            if first is not None:
                self.recorder.differ(
                    f"no arrow from `[*]`: the machine starts in `{first.key}`", first.at,
                    self.findings,
                )  # fmt: skip
                initial = initial_to(first.at.with_value(self.ids[first.key]))
        top = doc.DocState(None, doc.Kind.COMPOUND, root.at.span, initial, children)
        events = [
            doc.DocEvent(text, (), doc.Direction.IN)
            for name, text in self.events.items()
            if name not in self.raised
        ]
        events += [doc.DocEvent(t, (), doc.Direction.INTERNAL) for t in self.raised.values()]
        return doc.Document(
            self.source, self.diagram.name.with_value(legal(machine)), top, events=tuple(events),
            operations=self.operations.declarations(),
        )  # fmt: skip

    def _walk(self, node: Node) -> Iterator[Node]:
        for child in node.children:
            yield child
            yield from self._walk(child)

    def _is_plain(self, node: Node) -> bool:
        return node.kind in ("state", "choice")

    # --- states -------------------------------------------------------------------------------

    def _children(self, node: Node, section: int) -> tuple[doc.DocState, ...]:
        """Return the states of a region, and its final state if an arrow leads to ``[*]``."""
        found = [self._state(child) for child in node.sections[section] if child.kind not in BARS]
        if (node.key, section) in self.ends:
            name = node.at.with_value(self.ends[node.key, section])
            found.append(doc.DocState(name, doc.Kind.FINAL, node.at.span))
        return tuple(found)

    def _state(self, node: Node) -> doc.DocState:
        at = node.at.with_value(self.ids[node.key])
        span = node.at.span
        arrows = self.arrows.get(node.key, [])
        if node.kind in HISTORIES:
            default = [each for arrow in arrows for each in self._targets(arrow)]
            first = doc.DocTransition(doc.Trigger.INITIAL, span, targets=tuple(default))
            return doc.DocState(at, HISTORIES[node.kind], span, first if default else None)
        if node.kind == "choice":
            return doc.DocState(at, doc.Kind.CHOICE, span, transitions=self._legs(node, arrows))
        if self._is_final(node, arrows):
            entry = self._handlers(node)["entry"]
            return doc.DocState(at, doc.Kind.FINAL, span, entry=entry, doc=self._doc(node))
        transitions = [self._transition(arrow) for arrow in arrows]
        kept = [each for each in transitions if each is not None]
        handlers = self._handlers(node)
        sections = [number for number, one in enumerate(node.sections) if one]
        is_parallel = len(sections) > 1
        if is_parallel:
            initial: doc.DocTransition | None = None
            children: tuple[doc.DocState, ...] = tuple(
                region for number in sections for region in self._region(node, number)
            )
        else:
            number = sections[0] if sections else 0
            children, initial = self._children(node, number), self._initial(node, number)
        kind = (
            doc.Kind.PARALLEL if is_parallel else doc.Kind.COMPOUND if children else doc.Kind.ATOMIC
        )
        return doc.DocState(
            at, kind, span, initial=initial, children=children,
            transitions=(*kept, *self._reactions(node), *self.joins.get(node.key, ())),
            entry=handlers["entry"], exit=handlers["exit"], doc=self._doc(node),
        )  # fmt: skip

    def _region(self, node: Node, number: int) -> Iterator[doc.DocState]:
        """Yield a region: the only state of a section, or a state around those of the section."""
        states = [child for child in node.sections[number] if child.kind not in BARS]
        plain_states = [child for child in states if child.kind == "state"]
        has_start = any(section == number for section, _ in node.starts)
        others = [child for child in states if child.kind != "state"]
        is_whole = len(plain_states) == 1 and not has_start
        if is_whole and all(child.kind in HISTORIES for child in others):
            yield from map(self._state, states)
            return
        name = node.at.with_value(self.states.name(f"{self.ids[node.key]}_{number + 1}"))
        yield doc.DocState(
            name, doc.Kind.COMPOUND, node.at.span, self._initial(node, number),
            self._children(node, number),
        )  # fmt: skip

    def _initial(self, node: Node, section: int) -> doc.DocTransition | None:
        starts = [arrow for number, arrow in node.starts if number == section]
        for extra in starts[1:]:
            reject(self.findings, "a second arrow leads from `[*]`", extra.span, "remove one")
        for arrow in starts[:1]:
            label = self._label(arrow)
            if label.guard is not None:
                reject(self.findings, "an initial arrow has a guard", arrow.span, "draw a choice")
            block = self.content.block(label.content) if label.content is not None else ()
            return doc.DocTransition(
                doc.Trigger.INITIAL, arrow.span, targets=self._targets(arrow), content=block or None
            )
        return None

    def _is_final(self, node: Node, arrows: list[Arrow]) -> bool:
        """Return whether a state is final: its only arrow leads to ``[*]``, without a label."""
        is_leaf = not node.children and not self._reactions(node)
        return is_leaf and [(a.target, a.label) for a in arrows] == [(None, None)]

    # --- texts of states ----------------------------------------------------------------------

    def _items(self, node: Node) -> list[Text]:
        """Return the items of a state's text; lines that start with blanks continue an item."""
        items: list[Text] = []
        for text in (*node.lines, *node.notes):
            for line in plain(text.value).split("\n"):
                if items and (line.startswith(("  ", "\xa0")) or not line.strip()):
                    items[-1] = items[-1].with_value(f"{items[-1].value} {line.strip()}")
                elif line.strip():
                    items.append(text.with_value(line.strip()))
        return items

    def _handlers(self, node: Node) -> dict[str, tuple[Block, ...]]:
        found: dict[str, tuple[Block, ...]] = {"entry": (), "exit": ()}
        for item in self._items(node):
            if match := HANDLER.match(item.value):
                block = self.content.block(item.with_value(match[2]))
                found[match[1]] += (block,) if block else ()
        return found

    def _reactions(self, node: Node) -> tuple[doc.DocTransition, ...]:
        """Return the reactions in the box of a state: ``event [guard] / content``."""
        return tuple(
            self._from_label(self._parts(item), item.span, ())
            for item in self._items(node)
            if BOX.match(item.value) and not HANDLER.match(item.value)
        )

    def _doc(self, node: Node) -> str:
        words = [item.value for item in self._items(node) if not BOX.match(item.value)]
        title = node.title if node.title != self.ids[node.key] else ""
        return "\n".join([*([title] if title and title not in HISTORIES else []), *words])

    # --- arrows -------------------------------------------------------------------------------

    def _label(self, arrow: Arrow) -> _Label:
        if arrow.label is None:
            return _Label(None, None, None)
        return self._parts(arrow.label.with_value(" ".join(plain(arrow.label.value).split())))

    def _parts(self, text: Text) -> _Label:
        match = LABEL.match(text.value)
        if match is None:
            return _Label(text, None, None)
        words = {
            name: text.with_value(value.strip())
            for name in ("event", "guard", "content")
            if (value := match[name]) and value.strip()
        }
        return _Label(words.get("event"), words.get("guard"), words.get("content"))

    def _transition(self, arrow: Arrow) -> doc.DocTransition | None:
        if arrow.target is not None and arrow.target.kind == "join":
            return None
        targets = self._targets(arrow)
        return self._from_label(self._label(arrow), arrow.span, targets) if targets else None

    def _from_label(
        self, label: _Label, span: Span, targets: tuple[Text, ...]
    ) -> doc.DocTransition:
        guard = None if label.guard is None else self.content.guard(label.guard)
        block = self.content.block(label.content) if label.content is not None else ()
        made = doc.DocTransition(
            doc.Trigger.EVENTLESS, span, guard=guard, targets=targets, content=block or None
        )
        if label.event is None:
            return made
        if timer := TIMER.match(label.event.value):
            word = doc.Trigger.AFTER if timer[1] == "after" else doc.Trigger.EVERY
            return replace(made, trigger=word, delay=label.event.with_value(timer[2]))
        event = self._event(label.event)
        return replace(made, trigger=doc.Trigger.EVENT, events=(event,))

    def _event(self, text: Text) -> Text:
        if text.value not in self.events:
            name = self.event_names.name(text.value, "_event", source=text.value)
            self.events[text.value] = text.with_value(name)
            if name != text.value:
                self.recorder.rewrite("label", text.span, name)
        return text.with_value(self.events[text.value].value)

    def _legs(self, node: Node, arrows: list[Arrow]) -> tuple[doc.DocTransition, ...]:
        """Return the legs of a choice; a label without brackets is a guard."""
        legs = []
        for arrow in arrows:
            label = self._label(arrow)
            condition = label.guard or label.event
            is_else = condition is None or condition.value in ("else", "[else]")
            guard = None if is_else or condition is None else self.content.guard(condition)
            block = self.content.block(label.content) if label.content is not None else ()
            legs.append(
                doc.DocTransition(
                    doc.Trigger.EVENTLESS, arrow.span, guard=guard, targets=self._targets(arrow),
                    content=block or None,
                )
            )  # fmt: skip
        if not legs:
            self.findings.add(
                "foreign-syntax", f"no arrow leaves the choice `{node.key}`", node.at,
                help="draw one",
            )  # fmt: skip
        elif all(leg.guard is not None for leg in legs):
            self.recorder.differ(
                f"the choice `{node.key}` has no `else`: its last arrow is taken if no guard holds",
                legs[-1].span, self.findings,
            )  # fmt: skip
            legs[-1] = replace(legs[-1], guard=None)
        for extra in [leg for leg in legs if leg.guard is None][1:]:
            message = f"the choice `{node.key}` has two arrows without a guard"
            reject(self.findings, message, extra.span, "write `[guard]` at one of them")
        return tuple(sorted(legs, key=lambda leg: leg.guard is None))

    def _targets(self, arrow: Arrow) -> tuple[Text, ...]:
        """Return the targets of an arrow: a final state for ``[*]``, all ends of a fork."""
        if arrow.target is None:
            scope = arrow.source.parent or self.diagram.root
            region = next(n for n, states in enumerate(scope.sections) if arrow.source in states)
            key = scope.key, region
            if key not in self.ends:
                self.ends[key] = self.states.name(f"{self.ids.get(scope.key, 'machine')}_end")
            return (Text(self.ends[key], arrow.span, ()),)
        if arrow.target.kind != "fork":
            return (Text(self.ids[arrow.target.key], arrow.span, ()),)
        ends = [each.target for each in self.arrows.get(arrow.target.key, []) if each.target]
        if len(ends) < 2 or not all(
            self._is_orthogonal(one, two)
            for number, one in enumerate(ends)
            for two in ends[number + 1 :]
        ):
            reject(
                self.findings, f"the ends of the fork `{arrow.target.key}` are in one region",
                arrow.target.at, "draw a state with a region for each end",
            )  # fmt: skip
        return tuple(Text(self.ids[end.key], arrow.span, ()) for end in ends)

    def _is_orthogonal(self, one: Node, two: Node) -> bool:
        """Return whether two states are in different regions of a state."""
        path = _path(one)
        left, right = one, two
        while right.parent is not None and right.parent not in path:
            right = right.parent
        home = right.parent
        while left.parent is not home and left.parent is not None:
            left = left.parent
        if home is None or left is right or left.parent is not home:
            return False
        return all(left not in section or right not in section for section in home.sections)

    def _join(self, node: Node) -> None:
        """Let the state around the joined regions leave when all of them have arrived."""
        sources = [a for a in self.diagram.arrows if a.target is node]
        ends = self.arrows.get(node.key, [])
        homes = _path(sources[0].source)[1:] if sources else []
        home = next((h for h in homes if len(h.sections) > 1), None)
        is_plain = all(self._label(a) == _Label(None, None, None) for a in sources)
        if (
            home is None or len(ends) != 1 or len(sources) < 2 or not is_plain
            or not all(home in _path(a.source) for a in sources)
        ):  # fmt: skip
            reject(
                self.findings, f"the arrows to the join `{node.key}` are not from several regions",
                node.at, "draw one arrow without a label from each region of a state",
            )  # fmt: skip
            return
        label = self._label(ends[0])
        condition = " and ".join(f"In({self.ids[a.source.key]})" for a in sources)
        made = self._from_label(label, ends[0].span, self._targets(ends[0]))
        guard = condition if made.guard is None else f"{condition} and ({made.guard.value})"
        made = replace(made, guard=node.at.with_value(guard))
        self.joins.setdefault(home.key, []).append(made)

    def _special(self, statement: Text) -> Block | None:
        """Read ``raise event``, as drawings of charts have it."""
        match = RAISE.match(statement.value)
        if match is None:
            return None
        name = self._event(statement.with_value(match[1]))
        self.raised[match[1]] = name
        return (Raise(name, (), statement.span),)


def _path(node: Node) -> list[Node]:
    """Return a state and all states around it, the root included."""
    path = [node]
    while path[-1].parent is not None:
        path.append(path[-1].parent)
    return path
