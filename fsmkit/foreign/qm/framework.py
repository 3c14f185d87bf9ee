"""Calls of the QP framework in content: time events, posts to the machine itself, tracing."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from fsmkit.diagnostics import Text
from fsmkit.foreign.content import Operations, tokens
from fsmkit.language.statements.tree import Block, DocCancel, DocSend, Raise
from fsmkit.scxml.nodes import Element

SELF = r"(?:\(\s*QActive\s*\*\s*(?:const\s*)?\)\s*me|&\s*me->super|me|Q_ACTIVE_UPCAST\(\s*me\s*\))"
OWN = r"(?:this->|(?<![\w.>:]))"
NEW = r"(?:QP::)?QF::q_new<(?:QP::)?QEvt>\(\s*(?:\w+::)?(?P<signal>\w+)_SIG\s*\)"


@dataclass(frozen=True, slots=True)
class Calls:
    """The forms of calls of QP in a language, as regular expressions."""

    selves: tuple[str, ...]
    """How content names an attribute of the machine: what precedes the name."""
    created: re.Pattern[str]
    """The creation of a time event: its name, and its signal."""
    armed: re.Pattern[str]
    """Its name, and the arguments."""
    disarmed: re.Pattern[str]
    event: re.Pattern[str]
    """The declaration of a constant event: its name, and its signal."""
    posted: re.Pattern[str]
    """A post of an event without parameters to the machine itself."""
    published: re.Pattern[str]
    subscribed: re.Pattern[str]
    unreadable: tuple[tuple[re.Pattern[str], str], ...]
    """Calls with an effect on the machine, which no operation may hide."""


POSTED_TO_ITSELF = "an event is posted to the machine itself"
ARMED, DEFERRED = "a time event is armed or disarmed", "an event is deferred or recalled"
C = Calls(
    ("me->",),
    re.compile(r"QTimeEvt_ctorX?\(\s*&me->(\w+)\s*,[^;]*?\b(\w+)_SIG\b"),
    re.compile(r"(?:\(void\)\s*)?QTimeEvt_(?:arm|rearm)X?\(\s*&me->(\w+)\s*,(.*)\)", re.DOTALL),
    re.compile(r"(?:\(void\)\s*)?QTimeEvt_disarm\(\s*&me->(\w+)\s*\)"),
    re.compile(
        r"(?:static\s+)?(?:QEvt\s+const|const\s+QEvt)\s+(\w+)\s*=\s*"
        r"QEVT_INITIALIZER\(\s*(\w+)_SIG\s*\)"
    ),
    re.compile(
        rf"QACTIVE_POST(?P<first>_LIFO)?\(\s*{SELF}\s*,\s*"
        r"(?:&\s*(?P<name>\w+)|Q_NEW\(\s*QEvt\s*,\s*(?P<signal>\w+)_SIG\s*\))\s*(?:,[^()]*)?\)"
    ),
    re.compile(
        r"QACTIVE_PUBLISH\(\s*"
        r"(?:&\s*(?P<name>\w+)|Q_NEW\(\s*QEvt\s*,\s*(?P<signal>\w+)_SIG\s*\))"
    ),
    re.compile(r"QActive_subscribe\([^;]*?\b(\w+)_SIG\s*\)"),
    (
        (re.compile(rf"QACTIVE_POST\w*\(\s*{SELF}\s*,"), POSTED_TO_ITSELF),
        (re.compile(r"QTimeEvt_\w*(?:arm|disarm)X?\("), ARMED),
        (re.compile(r"QActive_(?:defer|recall)\("), DEFERRED),
    ),
)
CPP = Calls(
    ("this->", ""),
    re.compile(r"\b(\w+)\(\s*this\s*,\s*(?:\w+::)?(\w+)_SIG\b"),
    re.compile(r"(?:this->)?(\w+)\s*\.\s*(?:armX|rearm)\((.*)\)", re.DOTALL),
    re.compile(r"(?:\(void\)\s*)?(?:this->)?(\w+)\s*\.\s*disarm\(\s*\)"),
    re.compile(
        r"(?:static\s+)?(?:(?:QP::)?QEvt\s+const|const\s+(?:QP::)?QEvt)\s+(\w+)\s*[({]\s*"
        r"(?:\w+::)?(\w+)_SIG\s*[)}]"
    ),
    re.compile(
        rf"(?:this->)?(?:POST|post(?P<first>LIFO))\(\s*(?:&\s*(?P<name>\w+)|{NEW})\s*(?:,[^()]*)?\)"
    ),
    re.compile(rf"(?:QP::)?(?:QActive|QF)::PUBLISH\(\s*(?:&\s*(?P<name>\w+)|{NEW})"),
    re.compile(rf"{OWN}subscribe\(\s*(?:\w+::)?(\w+)_SIG\s*\)"),
    (
        (re.compile(rf"{OWN}(?:POST|post_|postLIFO)\("), POSTED_TO_ITSELF),
        (re.compile(r"\w\s*\.\s*(?:armX|rearm|disarm)\("), ARMED),
        (re.compile(rf"{OWN}(?:defer|recall)\("), DEFERRED),
    ),
)
IGNORED = re.compile(
    r"Q_UNUSED_PAR\(|QS_\w+\(|\(void\)\s*(?:par|me|e)\s*$|QActive_(?:un)?subscribe\(", re.DOTALL
)
"""Statements without an effect on the machine: tracing, unused parameters, subscriptions."""
SECOND = "BSP_TICKS_PER_SEC"
"""The customary name of the number of clock ticks in a second."""
DECLARATION = re.compile(
    r"(?:^|[;{}])\s*(?:static\s+|const\s+)*(?!return\b|else\b)[A-Za-z_]\w*(?:\s+const)?\s*\**\s+\**"
    r"(?:const\s+)?[A-Za-z_]\w*(?:\[[^\]]*\])?\s*(?:=|;|$)"
)
STRING = re.compile(r'"(?:\\.|[^"\\])*"')
DIRECTIVE = re.compile(r"^\s*#", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Periodic:
    """A periodic time event: its name, its signal, its period or ticks, and where it is armed."""

    name: str
    signal: str
    period: Text | None
    """A duration; None if the ticks are not a number of seconds."""
    ticks: Text
    at: Text


@dataclass(frozen=True, slots=True)
class Framework:
    """The time events, constant events and subscriptions of a class."""

    timers: Mapping[str, str]
    """The signals of time events, by name."""
    events: Mapping[str, str]
    """The signals of constant events, by name."""
    subscribed: frozenset[str]
    disarmed: frozenset[str]
    calls: Calls = C

    def first_local(self, text: str) -> int:
        """Return where the first statement with a local variable or a directive starts.

        The length of the text if all is read statement by statement.
        """
        if DIRECTIVE.search(_without_comments(text)):
            at = DIRECTIVE.search(text)
            start = 0 if at is None else at.start()
            return max((end for _, end in _outer_statements(text) if end < start), default=-1) + 1
        for start, end in _outer_statements(text):
            piece = self.calls.event.sub("", STRING.sub('""', _without_comments(text[start:end])))
            if DECLARATION.search(piece):
                return start
        return len(text)

    def statement(
        self,
        piece: Text,
        replaced: tuple[Periodic, ...],
        event: Callable[[Text], Text],
        operations: Operations,
    ) -> Block | None:
        """Return a statement of the framework; None for any other.

        Args:
            piece: The text of the statement.
            replaced: Periodic time events that a transition replaces.
            event: Returns the event of a signal.
            operations: Receives delays that are no number of seconds.

        """
        text = piece.value
        calls = self.calls
        if any(one.match(text) for one in (IGNORED, calls.subscribed)) or calls.event.fullmatch(
            text
        ):
            return ()
        if found := self.calls.disarmed.fullmatch(text):
            name = piece.part(*found.span(1))
            is_replaced = any(one.name == name.value for one in replaced)
            return () if is_replaced else (DocCancel(name, None, piece.span),)
        if found := self.calls.armed.fullmatch(text):
            return self._armed(piece, found, replaced, event, operations)
        if (found := self.calls.posted.fullmatch(text)) and (signal := self._signal(found)):
            sent = event(piece.with_value(signal))
            if found["first"]:
                return (Raise(sent, (), piece.span),)
            return (DocSend(piece.span, event=sent),)
        found = self.calls.published.match(text)
        if found and (signal := self._signal(found)) in self.subscribed:
            sent = event(piece.with_value(signal))
            return (*operations.action(piece), DocSend(piece.span, event=sent))
        return None

    def _signal(self, found: re.Match[str]) -> str:
        return found["signal"] or self.events.get(found["name"] or "", "")

    def _armed(
        self,
        piece: Text,
        found: re.Match[str],
        replaced: tuple[Periodic, ...],
        event: Callable[[Text], Text],
        operations: Operations,
    ) -> Block | None:
        name = found[1]
        if any(one.name == name for one in replaced):
            return ()
        arguments = _arguments(piece.part(*found.span(2)))
        signal = self.timers.get(name)
        if signal is None or not arguments or (len(arguments) > 1 and not _is_zero(arguments[1])):
            return None
        delay = duration(arguments[0])
        opaque = None if delay else arguments[0].with_value(operations.delay(arguments[0]))
        sent = event(piece.with_value(signal))
        timer = piece.part(*found.span(1))
        send = DocSend(piece.span, event=sent, delay=delay, delay_expr=opaque, id=timer)
        is_armed = "rearm" in piece.value  # arming an armed time event is an error in QP
        return (DocCancel(timer, None, piece.span), send) if is_armed else (send,)

    # --- periodic time events ---------------------------------------------------------------------

    def periodic_of(self, entry: Text | None, exit_: Text | None) -> tuple[Periodic, ...]:
        """Return the periodic time events that are armed at entry and disarmed at exit."""
        ended = set() if exit_ is None else set(self.calls.disarmed.findall(exit_.value))
        return tuple(one for one in self._periodic(entry) if one.name in ended)

    def periodic_for_ever(self, initial: Text | None) -> tuple[Periodic, ...]:
        """Return the periodic time events of the first transition that nothing disarms."""
        return tuple(one for one in self._periodic(initial) if one.name not in self.disarmed)

    def _periodic(self, text: Text | None) -> Iterator[Periodic]:
        """Yield the time events that are armed unconditionally, with equal delay and period."""
        if text is None:
            return
        for start, end in _outer_statements(text.value):
            piece = text.part(start, end)
            found = self.calls.armed.fullmatch(piece.value)
            arguments = _arguments(piece.part(*found.span(2))) if found else []
            if found is None or len(arguments) != 2 or found[1] not in self.timers:
                continue
            first, period = (_without_spaces(one.value) for one in arguments)
            if first == period and not _is_zero(arguments[1]):
                yield Periodic(
                    found[1], self.timers[found[1]], duration(arguments[1]), arguments[1], piece
                )


def framework_of(root: Element, machine: Element) -> Framework:
    """Return what a class declares; constructors may be operations outside of it."""
    inner = list(_texts(machine))
    base = machine.get("superclass")
    calls = CPP if base is not None and base.value.startswith("qpcpp") else C
    name = machine.get("name")
    own = "" if name is None else name.value
    outer = [text for text in _texts(root) if own and re.search(rf"\b{re.escape(own)}\b", text)]
    return Framework(
        dict(found for text in (*outer, *inner) for found in calls.created.findall(text)),
        dict(found for text in inner for found in calls.event.findall(text)),
        frozenset(found for text in inner for found in calls.subscribed.findall(text)),
        frozenset(found for text in inner for found in calls.disarmed.findall(text)),
        calls,
    )


def unreadable(text: str, framework: Framework) -> str | None:
    """Return what an opaque text does to the machine itself; None if it does nothing to it."""
    for pattern, what in framework.calls.unreadable:
        if pattern.search(text):
            return what
    if "PUBLISH(" in text:
        named = set(re.findall(r"\b(\w+)_SIG\b", text))
        if found := sorted(named & framework.subscribed):
            if framework.calls.published.match(text):
                return None  # it is sent besides
            return f"the machine publishes `{found[0]}`, and subscribes to it,"
    return None


def duration(ticks: Text) -> Text | None:
    """Return a number of ticks as a duration; None unless it is a constant number of seconds."""
    found = [token.text for token in tokens(_without_spaces(ticks.value))]
    if SECOND not in found or len(found) > 20:
        return None
    value, rest = _product(found)
    if rest or value is None or value <= 0 or (value * 1000).denominator != 1:
        return None
    is_whole = value.denominator == 1
    return ticks.with_value(f"{int(value)}s" if is_whole else f"{int(value * 1000)}ms")


def _product(found: list[str]) -> tuple[Fraction | None, list[str]]:
    """Return the value of a product, in which `SECOND` is 1, and the tokens behind it."""
    value, rest = _factor(found)
    while value is not None and rest and rest[0] in ("*", "/"):
        operand, after = _factor(rest[1:])
        if operand is None or (rest[0] == "/" and not operand):
            return None, rest
        value = value * operand if rest[0] == "*" else value / operand
        rest = after
    return value, rest


def _factor(found: list[str]) -> tuple[Fraction | None, list[str]]:
    if not found:
        return None, []
    if found[0] == "(":
        value, rest = _product(found[1:])
        return (value, rest[1:]) if rest[:1] == [")"] else (None, rest)
    if found[0] == SECOND:
        return Fraction(1), found[1:]
    is_number = found[0].isascii() and found[0].isdigit() and len(found[0]) < 10
    return (Fraction(int(found[0])) if is_number else None), found[1:]


def _arguments(text: Text) -> list[Text]:
    """Return the arguments of a call, from the text between its brackets."""
    found, start, depth = [], 0, 0
    for at, letter in enumerate(text.value):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and not depth:
            found.append(text.part(start, at).strip())
            start = at + 1
    return [*found, text.part(start, len(text.value)).strip()]


def _outer_statements(text: str) -> Iterator[tuple[int, int]]:
    """Yield the ranges of the statements that are in no block."""
    start, depth = None, 0
    for token in tokens(text):
        if start is None:
            start = token.start
        depth += (token.text in ("(", "[", "{")) - (token.text in (")", "]", "}"))
        if token.text == ";" and not depth:
            yield start, token.start
            start = None
        elif token.text == "}" and not depth:
            yield start, token.end
            start = None
    if start is not None:
        yield start, len(text)


def _texts(element: Element) -> Iterator[str]:
    yield element.text.value
    for child in element.children:
        yield from _texts(child)


def _is_zero(text: Text) -> bool:
    return re.fullmatch(r"0[uU]?[lL]*", text.value.strip()) is not None


def _without_spaces(text: str) -> str:
    text = _without_comments(text).replace("BSP::TICKS_PER_SEC", SECOND)
    return re.sub(r"(?<=\d)[uUlL]+\b|\s+", "", text)


def _without_comments(text: str) -> str:
    return "".join(" " if part.startswith(("//", "/*")) else part for part in _pieces(text))


def _pieces(text: str) -> list[str]:
    """Return comments, strings, and what is between them."""
    return re.split(r"""(//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*")""", text, flags=re.DOTALL)
