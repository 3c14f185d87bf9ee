"""From a class of Rhapsody with a statechart to a document.

A step handles one event, innermost states first, and then takes null transitions until none is
enabled. A transition leaves states, does its action and enters states, as in SCXML. The guards
along a path through condition connectors are evaluated first (D. Harel, H. Kugler, "The Rhapsody
semantics of statecharts", 2004).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.document.document import (
    Direction,
    DocData,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.content import Content, Operations, uses
from fsmkit.foreign.imports import Import, Recorder, counts, reject
from fsmkit.foreign.rewriting.static_choices import static_choices
from fsmkit.foreign.rewriting.tree import initial_to
from fsmkit.foreign.rhapsody.archive import Node, decode, read_archive
from fsmkit.foreign.rhapsody.xml_archive import read_xml
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Block, DocCancel, DocField, DocSend

__all__ = ["decode", "import_machine", "machines"]

TYPES = {
    "boolean": "bool", "bool": "bool", "RhpBoolean": "bool", "OMBoolean": "bool",
    "int": "int32", "RhpInteger": "int32", "long": "int32", "short": "int16", "byte": "int8",
    "unsigned int": "uint32", "unsigned long": "uint32", "unsigned short": "uint16",
    "unsigned char": "uint8", "uint8_t": "uint8", "uint16_t": "uint16", "uint32_t": "uint32",
    "int8_t": "int8", "int16_t": "int16", "int32_t": "int32",
    "float": "float32", "double": "float64", "RhpReal": "float64",
}  # fmt: skip
"""Types of Java, C and C++ and of Rhapsody itself, with those of charts."""
SELVES = ("", "this.", "this->", "me->")
"""How content names an attribute of its own object."""
SELF = r"(?:this\s*(?:\.|->)\s*)?"
NEW = r"(?:new\s+)?(?P<event>\w+)\s*(?:\(\s*\))?"
POSTED = re.compile(rf"{SELF}(?:gen|GEN)\(\s*{NEW}\s*\)|CGEN\(\s*me\s*,\s*(?P<c>\w+)\(\s*\)\s*\)")
"""An event without parameters that the machine sends to itself, in Java, C++ and C."""
SENT = re.compile(
    rf"get(?P<java>\w+)\(\)\.gen\(\s*{NEW}\s*\)"
    rf"|(?:OPORT|OUT_PORT)\(\s*(?P<port>\w+)\s*\)->GEN\(\s*(?P<sent>\w+)\s*(?:\(\s*\))?\s*\)"
    r"|CGEN_PORT\(\s*(?:me->)?(?P<c_port>\w+)\s*,\s*(?P<c_event>\w+)\(\s*\)\s*\)"
)
"""An event without parameters that leaves by a port."""
POSTING = re.compile(
    r"(?<![\w.>)])(?:gen|GEN)\s*\(|\bCGEN\w*\(\s*me\s*,|\bthis(?:\.|->)(?:gen|GEN)\("
)
"""Text that sends an event to its own object."""
SENDING, SEND_ACTION = "EventState", "ISendAction"
"""A state that sends an event when it is entered, and the action of its entry."""
KINDS = {"And": Kind.PARALLEL, "LocalTermination": Kind.FINAL, "Termination": Kind.FINAL}
"""Types of states that are not plain ones."""
CHOICES = frozenset({"Condition", "Junction"})
QUEUED = "R12"
"""The rewriting of a timeout into a delayed event."""
HISTORIES = frozenset({"History"})
"""A history connector restores all levels."""


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the names of the classes that have a statechart."""
    return tuple(_name(one) for one in _classes(_archive(source, findings)))


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return the machine of a class; None if it cannot be read."""
    archive = _archive(source, findings)
    found = next((one for one in _classes(archive) if _name(one) == machine), None)
    if found is None:
        return None
    elements = {
        one.word("_id"): one
        for top in archive
        for one in top.below()
        if one.word("_id") and not one.kind.endswith("Handle")
    }
    bodies = _bodies(found)
    variables = {
        name: data
        for name, data in _data(found).items()
        if not _is_shared(name, source.text, bodies)
    }
    while True:
        own, recorder = Findings(), Recorder()
        reader = _Machine(found, elements, variables, own, recorder)
        document = reader.document()
        opaque = reader.operations.opaque
        used = [n for n in variables if any(uses(opaque, f"{self_}{n}") for self_ in SELVES)
                or any(re.search(rf"\b[gs]et{n[:1].upper()}{re.escape(n[1:])}\(", one.text.value)
                       for one in opaque)]  # fmt: skip
        if not used:
            break
        variables = {name: data for name, data in variables.items() if name not in used}
    findings.extend(own)
    if document is None:
        return None
    _reject_posts([one.text for one in opaque], bodies, findings)
    read = counts(document)
    return recorder.imported(machine, static_choices(document, recorder, findings), read, opaque)


def _archive(source: Source, findings: Findings) -> list[Node]:
    """Return the objects of an archive of either format."""
    is_xml = source.text.lstrip().startswith("<")
    return read_xml(source, findings) if is_xml else read_archive(source, findings)


def _classes(archive: Iterable[Node]) -> list[Node]:
    return [one for top in archive for one in top.below() if one.kind == "IClass" and _charts(one)]


def _charts(machine: Node) -> list[Node]:
    """Return the statecharts of a class that have states besides the root."""
    return [one for one in machine.items("StateCharts") if len(one.items("States")) > 1]


def _name(node: Node) -> str:
    return node.word("_name") or node.kind


def _named(node: Node) -> Text:
    found = node.text("_name")
    return found if found is not None else Text(node.kind, node.span, ())


def _bodies(machine: Node) -> dict[str, str]:
    """Return the bodies of the operations of a class, by name."""
    return {
        _name(one): body.word("_bodyData")
        for one in machine.items("Operations")
        if (body := one.node("_itsBody")) is not None
    }


def _data(machine: Node) -> dict[str, DocData]:
    """Return the attributes of known types, by name."""
    namer, found = Namer(RESERVED), {}
    for one in machine.items("Attrs"):
        handle, name = one.node("_typeOf"), _named(one)
        type_ = TYPES.get("" if handle is None else handle.word("_name"))
        if type_ is None or not name.value.isidentifier():
            continue
        zero = "false" if type_ == "bool" else "0.0" if type_.startswith("float") else "0"
        given = [value for spec in one.items("ValueSpecifications")
                 if (value := spec.text("_value")) is not None]  # fmt: skip
        written = given[0].value.strip() if given else zero
        is_plain = re.fullmatch(r"-?\d{1,9}|true|false|-?\d{1,9}\.\d{1,9}", written)
        if is_plain and (written in ("true", "false")) == (type_ == "bool"):
            own = name.with_value(namer.name(name.value, "_value"))
            found[name.value] = DocData(own, name.with_value(type_), name.with_value(written))
    return found


def _is_shared(name: str, text: str, bodies: dict[str, str]) -> bool:
    """Return whether an attribute is used outside of the statechart of its class."""
    word = re.compile(rf"\b{re.escape(name)}\b")
    access = re.compile(rf"(?<!this)(?<!me)(?:\.|->){re.escape(name)}\b")
    return any(map(word.search, bodies.values())) or access.search(text) is not None


def _reject_posts(opaque_texts: list[Text], bodies: dict[str, str], findings: Findings) -> None:
    """Report opaque content that sends an event to the machine itself, also by its operations."""
    posting = {name for name, body in bodies.items() if POSTING.search(body)}
    while True:
        more = {
            name for name, body in bodies.items() if name not in posting and _calls(body, posting)
        }
        if not more:
            break
        posting |= more
    for text in opaque_texts:
        called = _calls(text.value, posting)
        if POSTING.search(text.value) or called:
            where = f", in the operation `{called}`" if called else ""
            reject(findings, f"an event is sent to the machine itself{where}", text,
                   "write `gen(new EVENT())` as a statement of its own")  # fmt: skip


def _calls(text: str, names: Iterable[str]) -> str:
    """Return the first of some operations that a text calls on its own object."""
    return next((n for n in names if re.search(rf"(?<![\w.>]){re.escape(n)}\s*\(", text)), "")


@dataclass
class _Machine:
    """Reads one class."""

    element: Node
    elements: dict[str, Node]
    """The elements of the archive, by id."""
    data: dict[str, DocData]
    findings: Findings
    recorder: Recorder
    operations: Operations = field(default_factory=Operations)
    names: dict[str, Text] = field(default_factory=dict)
    """The names of states and connectors, by id."""
    events: dict[str, DocEvent] = field(default_factory=dict)
    out: dict[str, DocEvent] = field(default_factory=dict)
    event_namer: Namer = field(default_factory=lambda: Namer(RESERVED))
    timers: dict[str, list[tuple[Text, Text, Text]]] = field(default_factory=dict)
    """By state: the event, the id and the delay of timeouts whose delay is computed."""
    moves: dict[str, list[DocTransition]] = field(default_factory=dict)
    initials: dict[str, DocTransition] = field(default_factory=dict)
    top: str = ""
    """The id of the root state."""

    def document(self) -> Document | None:
        """Return the document before all rewritings."""
        chart = _charts(self.element)[0]
        states, connectors = chart.items("States"), chart.items("Connectors")
        base = chart.node("_itsStateChart")
        if base is not None and base.word("_id"):
            reject(self.findings, "this statechart changes the one of a base class", chart.span,
                   "override the whole statechart in Rhapsody")  # fmt: skip
        roots = [one for one in states if not one.word("_parent")]
        if len(roots) != 1:
            self._broken("the statechart has no single root state", chart.span)
            return None
        namer = Namer(RESERVED)
        for one in (*states, *connectors):
            wanted = _named(one)
            self.names[one.word("_id")] = wanted.with_value(namer.name(wanted.value, "_state"))
        for one in chart.items("Transitions"):
            self._read_transition(one, {node.word("_id") for node in connectors})
        self._note_ties(states)
        self.top = roots[0].word("_id")
        initial = self.initials.get(self.top)
        if initial is None:
            self._broken("the statechart has no default transition", chart.span)
            return None
        nodes = [*states, *connectors]
        parents = {one.word("_id"): one.word("_parent") for one in nodes}
        if any(_is_circle(name, parents) for name in parents):
            self._broken("the states contain each other in a circle", chart.span)
            return None
        name = _named(self.element)
        return Document(
            self.element.span.source,
            name.with_value(Namer(RESERVED).name(name.value, "_machine")),
            DocState(
                None,
                Kind.COMPOUND,
                chart.span,
                initial=initial,
                children=self._children(self.top, nodes),
            ),
            data=tuple(self.data.values()),
            operations=self.operations.declarations(),
            events=(*self.events.values(), *self.out.values()),
        )

    def _broken(self, message: str, at: Span) -> None:
        self.findings.add("foreign-syntax", message, at, help="check the model in Rhapsody")

    # --- states -----------------------------------------------------------------------------------

    def _children(self, outer: str, nodes: list[Node]) -> tuple[DocState, ...]:
        found = []
        for one in nodes:
            if one.word("_parent") == outer and one.word("_id") != outer:
                state = self._state(one, nodes) if one.kind == "IState" else self._connector(one)
                if state is not None:
                    found.append(state)
        return tuple(found)

    def _state(self, node: Node, nodes: list[Node]) -> DocState:
        name, kind = node.word("_id"), node.word("_stateType")
        if kind not in (*KINDS, "", "Or", SENDING):
            reject(self.findings, f"a state of the type `{kind}` is not read", node.span,
                   "replace it by plain states")  # fmt: skip
        children = self._children(name, nodes)
        action = node.node("_entryAction")
        is_sending = action is not None and action.kind == SEND_ACTION
        entry = self._send(action) if action and is_sending else self._block(_body(action))
        exit_ = self._block(_body(node.node("_exitAction")))
        for event, id_, delay in self.timers.get(name, ()):
            entry += (DocSend(node.span, event=event, delay_expr=delay, id=id_),)
            exit_ += (DocCancel(id_, None, node.span),)
        return DocState(
            self.names[name],
            KINDS.get(kind, Kind.COMPOUND if children else Kind.ATOMIC),
            node.span,
            initial=None if kind == "And" else self.initials.get(name),
            children=children,
            transitions=tuple(self.moves.get(name, ())),
            entry=(entry,) if entry else (),
            exit=(exit_,) if exit_ else (),
        )

    def _connector(self, node: Node) -> DocState | None:
        name, kind = node.word("_id"), node.word("_connectorType")
        moves = tuple(self.moves.get(name, ()))
        if kind in CHOICES:
            ordered = sorted(moves, key=lambda move: move.guard is None)
            return DocState(self.names[name], Kind.CHOICE, node.span, transitions=tuple(ordered))
        if kind in HISTORIES:
            initial = initial_to(moves[0].targets[0]) if moves else None
            return DocState(self.names[name], Kind.DEEP_HISTORY, node.span, initial=initial)
        if kind == "Termination" and node.word("_parent") == self.top:
            return DocState(self.names[name], Kind.FINAL, node.span)
        what = f"a connector of the type `{kind or node.kind}` is not read"
        reject(self.findings, what, node.span, "replace it by transitions between states")
        return None

    # --- transitions ------------------------------------------------------------------------------

    def _read_transition(self, node: Node, connectors: set[str]) -> None:
        target, source = node.word("_itsTarget"), node.word("_itsSource")
        is_default = node.kind == "IDefaultDrvdTrans"
        outer = node.word("_ofState") if is_default else source
        is_static = node.word("_staticReaction") == "1" and not is_default
        if outer not in self.names or (target not in self.names and not is_static):
            self._broken("this transition has a loose end", node.span)
            return
        label = node.node("_itsLabel")
        trigger = None if label is None else label.node("_itsTrigger")
        fields = self._fields(trigger)
        content = Content(self.operations, {**self._variables(), **fields}, self._special,
                          self._numbers())  # fmt: skip
        guard_text = _body(None if label is None else label.node("_itsGuard"))
        is_else = guard_text is not None and guard_text.value.strip() == "else"
        guard = None if guard_text is None or is_else else content.guard(guard_text)
        action = _body(None if label is None else label.node("_itsAction"))
        block = content.block(action) if action is not None else ()
        if is_default:
            self.initials[outer] = initial_to(self.names[target], content=block or None)
            return
        targets = () if is_static else (self.names[target],)
        move = DocTransition(Trigger.EVENTLESS, node.span, guard=guard, targets=targets,
                             content=block or None)  # fmt: skip
        if outer not in connectors:
            move = self._triggered(move, trigger, outer)
        self.moves.setdefault(outer, []).append(move)

    def _triggered(self, move: DocTransition, trigger: Node | None, state: str) -> DocTransition:
        """Return a transition with its trigger: an event, a timeout or none."""
        if trigger is None:
            return move
        if trigger.kind != "ITimeout":
            event = self._event(trigger)
            return replace(move, trigger=Trigger.EVENT, events=() if event is None else (event,))
        time = trigger.text("_time") or trigger.text("_body")
        written = "" if time is None else re.sub(r"^\s*tm\((.*)\)\s*$", r"\1", time.value).strip()
        if written.isascii() and written.isdigit() and len(written) < 12 and time is not None:
            delay = time.with_value(f"{int(written)}ms")
            return replace(move, trigger=Trigger.AFTER, delay=delay)
        at = time if time is not None else Text("", trigger.span, ())
        event = at.with_value(self.event_namer.name(f"timeout_{self.names[state]}"))
        timer = at.with_value(event.value)
        expression = at.with_value(self.operations.delay(at.with_value(written)))
        self.timers.setdefault(state, []).append((event, timer, expression))
        self.out[event.value] = DocEvent(event, (), Direction.INTERNAL)
        self.recorder.rewrite(QUEUED, move.span, event.value)
        return replace(move, trigger=Trigger.EVENT, events=(event,))

    def _event(self, trigger: Node) -> Text | None:
        """Return the event of a trigger: a reception or a triggered operation.

        The text of a trigger keeps the old name of an event that was renamed or replaced, so the
        reference wins. It has an id, and a name if the event is in another unit.
        """
        handle, wanted = trigger.node("_itsInterfaceItem"), trigger.text("_body")
        declared = self.elements.get("" if handle is None else handle.word("_id"))
        name = self._referenced(handle)
        if name:
            wanted = (Text("", trigger.span, ()) if wanted is None else wanted).with_value(name)
        if wanted is None or not wanted.value.strip():
            reject(self.findings, f"a trigger of the kind `{trigger.kind}` is not read",
                   trigger.span, "trigger the transition by an event or a timeout")  # fmt: skip
            return None
        return wanted.with_value(self._declare(wanted, declared).name.value)

    def _referenced(self, handle: Node | None) -> str:
        """Return the name of an element, without its signature; empty if it is not known."""
        if handle is None:
            return ""
        element = self.elements.get(handle.word("_id"), handle)
        return element.word("_name").split("(")[0].strip()

    def _declare(self, named: Text, declared: Node | None = None) -> DocEvent:
        if named.value not in self.events:
            name = named.with_value(self.event_namer.name(named.value.strip(), "_event"))
            fields = () if declared is None else _event_fields(declared, name)
            self.events[named.value] = DocEvent(name, fields, Direction.IN)
        return self.events[named.value]

    def _fields(self, trigger: Node | None) -> dict[str, str]:
        """Return the parameters of an event as content names them."""
        handle = None if trigger is None else trigger.node("_itsInterfaceItem")
        declared = self.elements.get("" if handle is None else handle.word("_id"))
        names = (
            ()
            if declared is None
            else [one.name.value for one in _event_fields(declared, _named(declared))]
        )
        return {f"params{arrow}{name}": f"event.{name}" for name in names for arrow in ("->", ".")}

    def _note_ties(self, states: list[Node]) -> None:
        """Record where Rhapsody leaves the order of transitions open."""
        for state in states:
            seen: set[tuple[object, ...]] = set()
            for move in self.moves.get(state.word("_id"), ()):
                key = move.trigger, move.events, move.delay
                is_tie, seen = key in seen, seen | {key}
                if is_tie:
                    self.recorder.differ(
                        f"the order of transitions of `{self.names[state.word('_id')]}` is open in "
                        "Rhapsody; the chart tries them in the order of the file",
                        move.span,
                        self.findings,
                    )
                    break

    # --- content ----------------------------------------------------------------------------------

    def _variables(self) -> dict[str, str]:
        return {f"{s}{name}": d.name.value for name, d in self.data.items() for s in SELVES}

    def _numbers(self) -> frozenset[str]:
        return frozenset(
            f"{s}{name}" for name, d in self.data.items() for s in SELVES if str(d.type) != "bool"
        )

    def _block(self, text: Text | None) -> Block:
        if text is None:
            return ()
        return Content(self.operations, self._variables(), self._special, self._numbers()).block(
            text
        )

    def _special(self, piece: Text) -> Block | None:
        """Return a statement that sends an event; None for any other."""
        found = POSTED.fullmatch(piece.value)
        if found:
            sent = self._declare(piece.with_value(found["event"] or found["c"])).name
            return (DocSend(piece.span, event=piece.with_value(sent.value)),)
        found = SENT.fullmatch(piece.value)
        if found:
            port = found["java"] or found["port"] or found["c_port"]
            return self._sent(port, found["event"] or found["sent"] or found["c_event"], piece)
        return None

    def _send(self, action: Node) -> Block:
        """Return the statement of an action that sends an event to a port or another object."""
        event, target = (self._referenced(action.node(key)) for key in ("m_hEvent", "m_hTarget"))
        at = Text("", action.span, ())
        values = [one.word("_data") for one in action.below() if one.kind == "IHandleWithData"]
        if not event or not target:
            reject(self.findings, "this send action names no event, or no target in this file", at,
                   "send it by an action, such as `OPORT(port)->GEN(event)`")  # fmt: skip
            return ()
        if action.word("_ArgValCount") in ("", "0") and not values:
            return self._sent(target, event, at)
        code = f"{target}->GEN({event}({', '.join(values)}))"
        return self.operations.action(at.with_value(code))

    def _sent(self, port: str, event: str, at: Text) -> Block:
        """Return the statement that sends an event by a port, and declare the event."""
        key = f"{port[:1].lower()}{port[1:]}_{event}"
        if key not in self.out:
            name = at.with_value(self.event_namer.name(key))
            self.out[key] = DocEvent(name, (), Direction.OUT)
        return (DocSend(at.span, event=at.with_value(self.out[key].name.value)),)


def _event_fields(declared: Node, at: Text) -> tuple[DocField, ...]:
    """Return the parameters of an event; none unless all have known types."""
    found: list[DocField] = []
    for one in declared.items("Args"):
        handle, name = one.node("_typeOf"), one.word("_name")
        type_ = TYPES.get("" if handle is None else handle.word("_name"))
        if type_ is None or not name.isidentifier() or name in RESERVED:
            return ()
        found.append(DocField(at.with_value(name), at.with_value(type_)))
    return tuple(found)


def _body(node: Node | None) -> Text | None:
    """Return the text of an action or a guard; None if it is empty."""
    found = None if node is None else node.text("_body")
    return None if found is None or not found.value.strip() else found.strip()


def _is_circle(name: str, parents: dict[str, str]) -> bool:
    seen = set()
    while name and name not in seen:
        seen.add(name)
        name = parents.get(name, "")
    return bool(name)
