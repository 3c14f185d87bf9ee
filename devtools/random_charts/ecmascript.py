"""Random charts in SCXML with ``datamodel="ecmascript"``: `random_scxml` gives the text.

What they hold is what real files hold: data without types, content that may fail, and no
declarations of events.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from devtools.random_charts.aims import Aims
from devtools.random_charts.choices import Choices
from devtools.random_charts.content import MOST_TURNS, SENT, TURNS
from devtools.random_charts.ecmascript_content import (
    IDS,
    LATER,
    MADE,
    MAYBE,
    MESSAGES,
    NUMBERS,
    OBJECT,
    OPEN,
    OTHER,
    STRINGS,
    TEXT,
    WORDS,
    Message,
    Script,
    is_below,
    tag,
)
from devtools.random_charts.tree import HISTORIES, Grower, Node
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.document import Document, Kind
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0" '
    'name="Random" datamodel="ecmascript"'
)
PLATFORM = ("error.execution", "error", "error.*", "error.communication")


def random_ecmascript(choices: Choices, states: int = 12) -> Document:
    """Return a document of about that many states at most."""
    findings = Findings()
    source = Source("<random>", random_scxml(choices, states))
    document = plugin(FrontEnd, "scxml").read(source, findings)
    findings.stop_on_errors()
    assert document is not None  # noqa: S101
    return document


def random_scxml(choices: Choices, states: int = 12) -> str:
    """Return the text of a chart of about that many states at most."""
    root = Grower(choices, choices.integer(1, states)).root()
    for node in root.walk():
        if node.kind is Kind.CHOICE:  # no word of SCXML
            node.kind = Kind.ATOMIC
    return _Writer(choices, root).chart()


@dataclass
class _Writer:
    choices: Choices
    root: Node

    def __post_init__(self) -> None:
        self.aims = Aims(self.choices, self.root)
        ids = tuple(node.id for node in self.root.below() if node.is_real)
        self.plain = Script(self.choices, ids)

    def chart(self) -> str:
        """Return the text."""
        late = ' binding="late"' if self.choices.chance(25) else ""
        initial = self.aims.initial(self.root)
        start = f' initial="{_names(initial)}"' if self.choices.chance(70) else ""
        bound = self.choices.pick(("24", "24", "16", "4"))
        capacity = tag("fk:capacity", queue=self.choices.pick(("8", "4", "2")), internal=bound)
        script = ""
        if self.choices.chance(40):
            script = tag("script", _script_text(self.plain))
        body = "\n".join(self.state(child) for child in self.root.children)
        return f"{HEAD}{late}{start}>\n{capacity}{self._data()}{script}\n{body}\n</scxml>\n"

    def _data(self) -> str:
        found = [tag("data", id=n, expr=str(self.choices.integer(0, 9))) for n in NUMBERS]
        found += [tag("data", id=s, expr=f"'{self.choices.pick(WORDS)}'") for s in STRINGS]
        found += [tag("data", id=name, expr="0") for name in (SENT, TURNS)]
        found += [
            tag("data", id="flag", expr=self.choices.pick(("false", "true"))),
            tag("data", id="x0", expr=self.choices.pick(("0.5", "1.5", "-2.25"))),
            tag("data", id="numbers", expr=self.choices.pick(("[1, 2, 3]", "[4, 0, 7, 7]"))),
            tag("data", id="words", expr="['idle', 'busy']"),
            tag("data", id=LATER, expr="'10ms'"),
            tag("data", id=MAYBE),
            tag("data", id=TEXT, expr="'up.1'"),
            tag("data", id=MADE, expr="''"),
            tag("data", id=OPEN, expr="[]", type="int32[]"),
            tag("data", id=OTHER, expr="[5]", type="int32[]"),
            tag("data", id=OBJECT, expr="{a: 1, b: 2}"),
            tag("data", id=IDS),
        ]
        if self.choices.chance(8):
            found.append(tag("data", id="bad", expr="new Date()"))
        return tag("datamodel", "".join(found))

    # --- states -----------------------------------------------------------------------------

    def state(self, node: Node) -> str:
        """Return a state with all below it."""
        if node.kind in HISTORIES:
            kind = "deep" if node.kind is Kind.DEEP_HISTORY else "shallow"
            default = tag("transition", self._perhaps_content(), target=self._start(node))
            return tag("history", default, id=node.id, type=kind)
        body = self._local_data(node) + self._handlers("onentry") + self._handlers("onexit")
        if node.kind is Kind.FINAL:
            return tag("final", body + self._done_data(node), id=node.id)
        initial = None
        if node.kind is Kind.COMPOUND:
            match self.choices.integer(0, 2):
                case 0:
                    initial = self._start(node)
                case 1:
                    content = self._perhaps_content()
                    body += tag("initial", tag("transition", content, target=self._start(node)))
        body += "".join(self._transitions(node))
        body += "\n".join(self.state(child) for child in node.children)
        name = "parallel" if node.kind is Kind.PARALLEL else "state"
        return tag(name, body, id=node.id, initial=initial)

    def _start(self, node: Node) -> str:
        return _names(self.aims.initial(node))

    def _local_data(self, node: Node) -> str:
        if node.kind is Kind.FINAL or not self.choices.chance(8):
            return ""
        return tag("datamodel", tag("data", id=f"of_{node.id}", expr=self.plain.number(0)))

    def _handlers(self, name: str) -> str:
        if not self.choices.chance(30):
            return ""
        count = 2 if self.choices.chance(15) else 1
        return "".join(tag(name, self.plain.block(2)) for _ in range(count))

    def _perhaps_content(self) -> str:
        return self.plain.block(2) if self.choices.chance(25) else ""

    def _done_data(self, node: Node) -> str:
        """Return ``donedata``: of some states always one value, of the others always two."""
        parent = node.parent
        if parent is None or parent.parent is None or not self.choices.chance(60):
            return ""
        if _done(parent).style == "content":
            return tag("donedata", tag("content", expr=self.plain.number(1)))
        number = tag("param", name="p", expr=self.plain.number(1))
        string = tag("param", name="q", expr=self.plain.string())
        return tag("donedata", number + string)

    # --- transitions ------------------------------------------------------------------------

    def _transitions(self, node: Node) -> list[str]:
        found = [self._transition(node) for _ in range(self.choices.pick((1, 2, 0, 3, 2, 4)))]
        if node.can_end and self.choices.chance(60):
            message = _done(node)
            part = "_event.data" if message.style == "content" else "_event.data.p"
            content = tag("log", expr=part) if message.numbers else ""
            content += replace(self.plain, message=message).block(2)
            target = _names(self.aims.targets(node)) or None
            found.append(tag("transition", content, event=message.name, target=target))
        if node.depth == 1 and self.choices.chance(50):
            found.append(tag("transition", self.plain.block(1), event="error"))
        return found

    def _transition(self, node: Node) -> str:
        kind = self.choices.integer(0, 19)
        targets = self.aims.targets(node)
        internal = "internal" if targets and self.choices.chance(20) else None
        target = _names(targets) or None
        if kind >= 18:
            return self._eventless(target, internal)
        events, script = self._matched(kind)
        guard = script.guard() if self.choices.chance(40) else None
        content = script.block(2) if self.choices.chance(60) else ""
        return tag("transition", content, event=events, cond=guard, target=target, type=internal)

    def _eventless(self, target: str | None, internal: str | None) -> str:
        guard = f"({self.plain.test()}) && "
        guard += is_below(TURNS, self.choices.integer(1, MOST_TURNS))
        content = tag("assign", location=TURNS, expr=f"{TURNS} + 1") + self._perhaps_content()
        return tag("transition", content, cond=guard, target=target, type=internal)

    def _matched(self, kind: int) -> tuple[str, Script]:
        """Return descriptors, and what knows the event whose payload they leave no doubt about."""
        if kind < 10:
            message = self.choices.pick(MESSAGES)
            return message.name, replace(self.plain, message=message)
        ended = [node for node in self.root.below() if node.can_end]
        if kind < 13 and ended:
            node = self.choices.pick(ended)
            return f"done.state.{node.id}", replace(self.plain, message=_done(node))
        if kind < 15:
            return self.choices.pick((*PLATFORM, "done.state", "done.*")), self.plain
        if kind == 15:
            return self.choices.pick(("group", "group.*", "group.g3.")), self.plain
        if kind == 16:
            chosen = self.choices.some(MESSAGES, 3)
            return " ".join(message.name for message in chosen), self.plain
        return self.choices.pick(("*", "r0", "r1 group.r2")), self.plain


def _done(node: Node) -> Message:
    """Return the done event of a state; its number depends on the done data of its final states."""
    name = f"done.state.{node.id}"
    if node.kind is Kind.PARALLEL:
        return Message(name)
    if int(node.id[1:]) % 3 == 0:
        return Message(name, ("",), (), "content")
    return Message(name, ("p",), ("q",))


def _names(nodes: tuple[Node, ...]) -> str:
    return " ".join(node.id for node in nodes)


def _script_text(script: Script) -> str:
    return f"<![CDATA[{script.script(1)}]]>"
