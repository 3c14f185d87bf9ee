"""Lower the constructs of the loose dialects to plain statements, before typing.

* The ``content`` of an event is its field ``data``, or its members where it is an object.
* An attribute of ``send`` or ``cancel`` that is the value of a variable becomes a choice among
  the strings that the variable is ever given: so they are all known at compile time. The same
  applies to assignments that join strings, and to event names that contain the current one.
* The id of a sent event is known, also where it is generated. If the chart reads
  ``_event.sendid``, the id goes with the event.
* A variable that is compared with ``undefined`` has a flag, set by each of its assignments.
"""

from __future__ import annotations

import operator
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, TypeVar

from fsmkit.chart.ecmascript.joined_names import MOST_NAMES, JoinedNames, find_joined_names
from fsmkit.chart.ecmascript.joined_values import decide_joins
from fsmkit.chart.ecmascript.known_strings import KnownStrings, assigned, find_strings
from fsmkit.chart.ecmascript.string_methods import decide_methods
from fsmkit.chart.ecmascript.string_values import CURRENT_NAME
from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import DocData, DocInvoke, DocState, DocTransition, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.literal_content import content_value, members, string
from fsmkit.document.survey import Survey
from fsmkit.language import flag_of
from fsmkit.language.binding.ecmascript import NOTHING, SEND_ID, WHOLE_PAYLOAD
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.tokens import unescape

Part = TypeVar("Part")
STRING = re.compile(r"""\s*(?:'((?:\\.|[^'\\\n])*)'|"((?:\\.|[^"\\\n])*)")\s*""")
ASKED = re.compile(
    r"typeof\s*\(?\s*([\w$]+)|(?<![\w$])([\w$]+)\s*[!=]==?\s*(?:undefined|null)\b"
    r"|\b(?:undefined|null)\s*[!=]==?\s*([\w$]+)"
)
NUMBER = re.compile(r"\s*\d+\s*")
COMPUTED = ("event", "target", "type", "delay")
"""Attributes of `DocSend` that may be expressions."""


def lower_ecmascript(survey: Survey, given: InvocationContext | None = None) -> Document:
    """Return a document of a loose dialect without the constructs that only it has.

    ``given`` holds the values that an invoker sets when the machine starts.
    """
    if survey.document.datamodel == "fsmkit":
        return survey.document
    survey = decide_joins(decide_methods(survey, given), given)
    return _Lowering(survey.document, given).run(survey)


def string_value(text: Text) -> str | None:
    """Return the value of a text that is one string literal."""
    found = STRING.fullmatch(text.value)
    return None if found is None else unescape(next(g for g in found.groups() if g is not None))


def _is_open(send: stmt.DocSend, name: str) -> bool:
    """Whether an attribute of a send is the value of an expression which is no delay as it is."""
    expression: Text | None = getattr(send, f"{name}_expr")
    if expression is None or getattr(send, name) is not None:
        return False
    return name != "delay" or string_value(expression) is None


@dataclass
class _Lowering:
    document: Document
    given: InvocationContext | None = None
    strings: KnownStrings = field(default_factory=lambda: KnownStrings("", {}))
    joined: JoinedNames = field(default_factory=lambda: JoinedNames(KnownStrings("", {})))
    flagged: tuple[str, ...] = ()
    reads_ids: bool = False
    sent_numbers: frozenset[str] = frozenset()
    """Data that start as a number and are only ever used as strings."""

    def run(self, survey: Survey) -> Document:
        document, whole, written = survey.document, survey.parts, survey.texts
        self.strings = find_strings(document, whole, self.given, self._placeholders(whole, written))
        self.joined = find_joined_names(document, whole, self.given, self.strings)
        hosts = {written.name.value for written in (*document.inputs, *document.outputs)}
        declared = {
            part.name.value: part
            for part in whole
            if isinstance(part, DocData) and part.name.value not in hosts
        }
        asked = {
            name
            for value in survey.values
            for match in ASKED.finditer(value)
            for name in match.groups()
            if name is not None
        }
        self.reads_ids = any("_event.sendid" in value for value in survey.values)
        data = [self._with_string_start(written) for written in document.data]
        self.flagged = tuple(name for name in declared if name in asked)
        given = () if self.given is None else [name for name, _ in self.given.data]
        for flagged in self.flagged:
            at = declared[flagged].name
            init = declared[flagged].init
            has_value = flagged in given or not (init is None or init.value.strip() in NOTHING)
            data.append(
                DocData(
                    at.with_value(flag_of(flagged)),
                    at.with_value("bool"),
                    at.with_value("true" if has_value else "false"),
                )
            )
        return replace(
            document,
            data=tuple(data),
            root=self._state(document.root),
            script=self._block(document.script),
            posted=tuple(at.with_value(name) for name, at in sorted(self.joined.derived.items())),
        )

    def _with_string_start(self, data: DocData) -> DocData:
        if data.init is not None and data.init.value.strip() in NOTHING:
            return replace(data, init=None)
        if data.name.value not in self.sent_numbers or data.init is None:
            return data
        return replace(data, init=string(data.init.value.strip(), data.init))

    def _placeholders(self, whole: tuple[object, ...], written: tuple[Text, ...]) -> dict[str, str]:
        """Return the numbers that only hold the place of a string, and note whose they are."""
        numbers = {
            part.name.value: part.init.value.strip()
            for part in whole
            if isinstance(part, DocData) and part.type is None and part.init is not None
            if NUMBER.fullmatch(part.init.value) and _is_only_sent(part.name.value, whole, written)
        }
        if not numbers:
            return {}
        known = find_strings(self.document, whole, self.given, numbers)
        self.sent_numbers = frozenset(
            name for name in numbers if len(known.strings_of(name) or ()) > 1
        )
        return {name: numbers[name] for name in self.sent_numbers}

    # --- the tree -------------------------------------------------------------------------

    def _state(self, state: DocState) -> DocState:
        done_data, done_content = state.done_data, state.done_content
        if done_content is not None and not done_data:
            done_data, done_content = _payload(done_content), None
        done_data = apart(done_data)
        return _changed(
            state,
            children=_map_parts(self._state, state.children),
            initial=None if state.initial is None else self._transition(state.initial),
            transitions=_map_parts(self._transition, state.transitions),
            entry=_map_parts(self._block, state.entry),
            exit=_map_parts(self._block, state.exit),
            data=_map_parts(self._with_string_start, state.data),
            invokes=_map_parts(self._invoke, state.invokes),
            done_data=done_data,
            done_content=done_content,
        )

    def _transition(self, transition: DocTransition) -> DocTransition:
        content = transition.content
        return _changed(transition, content=None if content is None else self._block(content))

    def _block(self, block: stmt.Block) -> stmt.Block:
        lowered = tuple(made for statement in block for made in self._statement(statement))
        is_same = len(lowered) == len(block) and all(map(operator.is_, lowered, block))
        return block if is_same else lowered

    def _statement(self, statement: stmt.WrittenStatement) -> stmt.Block:
        match statement:
            case stmt.Assign(location, value, span, "") if (
                value.value.strip() in NOTHING and location.value.strip() in self.flagged
            ):
                return (self._flag(location, span, "false"),)
            case stmt.Assign(location, _, span):
                return (*self._assign(statement), *self._set(location, span))
            case stmt.If(branches):
                done = tuple(replace(b, body=self._block(b.body)) for b in branches)
                return (replace(statement, branches=done),)
            case stmt.ForEach(_, item, index, body, span):
                flags = self._set(item, span) + (() if index is None else self._set(index, span))
                return (replace(statement, body=(*flags, *self._block(body))),)
            case stmt.DocSend(id=Text() as made, id_location=Text() as location, span=span):
                stored = stmt.Assign(location, string(made.value, location), span)
                named = replace(statement, id_location=None)
                return (stored, *self._set(location, span), *self._send(named))
            case stmt.DocSend():
                return self._send(statement)
            case stmt.DocCancel(None, Text() as expression, span):
                return self._choose(
                    expression, span, lambda id_: (replace(statement, id=id_, id_expr=None),)
                ) or (statement,)
            case _:
                return (statement,)

    def _assign(self, statement: stmt.Assign[Text, Text]) -> stmt.Block:
        """Return an assignment that joins strings as a choice among those it can make."""
        value = assigned(statement.location, statement.value, statement.operator)
        if not self.strings.joins(value):
            return (statement,)
        return self._choose(
            value,
            statement.span,
            lambda made: (replace(statement, value=string(made.value, made), operator=""),),
            statement,
        ) or (statement,)

    def _set(self, location: Text, span: Span) -> stmt.Block:
        name = location.value.strip()
        if name not in self.flagged:
            return ()
        return (self._flag(location, span, "true"),)

    def _flag(self, location: Text, span: Span, value: str) -> stmt.Assign[Text, Text]:
        flag = flag_of(location.value.strip())
        return stmt.Assign(location.with_value(flag), location.with_value(value), span)

    def _invoke(self, invoke: DocInvoke) -> DocInvoke:
        finalize = None if invoke.finalize is None else self._block(invoke.finalize)
        return replace(
            invoke,
            finalize=finalize,
            types=self._values(invoke.type_expr),
            sources=self._values(invoke.src_expr),
        )

    def _values(self, expression: Text | None) -> tuple[tuple[Text | None, Text], ...]:
        """Return each string that an expression can be, behind the condition that it is."""
        if expression is None:
            return ()
        text = expression.with_value
        return tuple(
            (None if choice.condition is None else text(choice.condition), text(choice.value))
            for choice in self.strings.choices(expression)
        )

    # --- send and cancel ------------------------------------------------------------------

    def _send(self, send: stmt.DocSend) -> stmt.Block:
        content = send.content_expr
        if content is None and send.content is not None and not send.content.value.startswith("<"):
            content = content_value(send.content)
        if content is not None and not send.arguments and not send.name_list:
            send = replace(send, arguments=_payload(content), content=None, content_expr=None)
        return self._named(send)

    def _named(self, send: stmt.DocSend) -> stmt.Block:
        """Return a send whose attributes are known, a choice for each that is a variable."""
        name = next((name for name in COMPUTED if _is_open(send, name)), None)
        if name is None:
            return (self._with_id(self._apart(send)),)
        expression: Text = getattr(send, f"{name}_expr")

        def with_value(value: Text) -> stmt.Block:
            known: dict[str, Any] = {name: value, f"{name}_expr": None}
            return self._named(replace(send, **known))

        if chosen := self._choose(expression, send.span, with_value):
            return chosen
        joined = self._joined(send, expression) if name == "event" else None
        return (self._with_id(self._apart(send)),) if joined is None else joined

    def _joined(self, send: stmt.DocSend, expression: Text) -> stmt.Block | None:
        """Return a choice among the events whose names are joined; None if they are not known."""
        choices = self.joined.choices(send, expression)
        if choices is None:
            if id(expression) not in self.joined.endless:
                return None
            reason = f"`{expression}` joins more than {MOST_NAMES} names of events"
            return (stmt.Fail(reason, expression.span),)

        text = expression.with_value
        branches: list[stmt.Branch[Text, stmt.WrittenStatement]] = []
        if self.joined.may_lack_event(expression):
            failure = stmt.Fail(f"`{expression}` needs a current event", expression.span)
            branches.append(stmt.Branch(text(f"{CURRENT_NAME} == ''"), (failure,)))
        for choice in choices:
            body = self._named(replace(send, event=text(choice.value), event_expr=None))
            if choice.condition is None and not branches:
                return body
            condition = None if choice.condition is None else text(choice.condition)
            branches.append(stmt.Branch(condition, body))
        return (stmt.If(tuple(branches), send.span),) if branches else ()

    def _apart(self, send: stmt.DocSend) -> stmt.DocSend:
        """Return a send without duplicate fields; declared events have none."""
        is_declared = send.event is not None and send.event.value in self._declared()
        return send if is_declared else with_fields_of_their_own(send)

    def _declared(self) -> set[str]:
        return {event.name.value for event in self.document.events}

    def _with_id(self, send: stmt.DocSend) -> stmt.DocSend:
        """Return a send whose id goes with the event, if the chart reads ids (SCXML 5.10.1)."""
        if not self.reads_ids or send.id is None or send.event is None:
            return send
        if send.event.value in self._declared() or send.event.value.startswith("done."):
            return send
        name = send.id.with_value(SEND_ID)
        sent = stmt.DocArgument(name, string(send.id.value, send.id))
        return replace(send, arguments=(*send.arguments, sent))

    def _choose(
        self,
        expression: Text,
        span: Span,
        then: Callable[[Text], stmt.Block],
        statement: stmt.Assign[Text, Text] | None = None,
    ) -> stmt.Block:
        """Return a choice of ``then`` for each possible string of an expression, if known."""
        choices = self.strings.choices(expression, statement)
        branches: list[stmt.Branch[Text, stmt.WrittenStatement]] = []
        for choice in choices:
            body = then(expression.with_value(choice.value))
            if choice.condition is None and not branches:
                return body
            condition = None
            if choice.condition is not None:
                condition = expression.with_value(choice.condition)
            branches.append(stmt.Branch(condition, body))
        if branches and branches[-1].condition is not None:
            failure = stmt.Fail(f"`{expression}` has no value", span)
            branches.append(stmt.Branch(None, (failure,)))
        return (stmt.If(tuple(branches), span),) if branches else ()


def _map_parts(change: Callable[[Part], Part], parts: tuple[Part, ...]) -> tuple[Part, ...]:
    """Return the results of ``change`` for each part; the same tuple if no part changes."""
    made = tuple(map(change, parts))
    return parts if all(map(operator.is_, made, parts)) else made


def _changed(whole: Part, **parts: object) -> Part:
    """Return a copy of `whole` with other parts, or `whole` itself if they are equal."""
    if all(getattr(whole, name) is part for name, part in parts.items()):
        return whole
    changed: Part = replace(whole, **parts)  # type: ignore[type-var]
    return changed


def _is_only_sent(name: str, whole: tuple[object, ...], written: tuple[Text, ...]) -> bool:
    """Whether a variable is only assigned, and read only as an attribute of a sent event.

    Then a number that it starts with may as well be written as a string.
    """
    expected = 0
    for part in whole:
        match part:
            case DocData(name=Text(value=value)) | stmt.Assign(location=Text(value=value)):
                expected += value.strip() == name
            case stmt.DocSend():
                sent = (part.event_expr, part.target_expr, part.type_expr, part.delay_expr)
                expected += sum(text is not None and text.value.strip() == name for text in sent)
            case _:
                pass
    mention = re.compile(rf"(?<![\w$]){re.escape(name)}(?![\w$])")
    return expected == sum(len(mention.findall(t.value)) for t in written if name in t.value)


def _payload(content: Text) -> tuple[stmt.DocArgument, ...]:
    """Return a payload that is one value, or the members of an object."""
    inside = members(content)
    if inside is None:
        return (stmt.DocArgument(content.with_value(WHOLE_PAYLOAD), content),)
    return tuple(
        stmt.DocArgument(content.with_value(name), value) for name, value in inside.items()
    )


def with_fields_of_their_own(send: stmt.DocSend) -> stmt.DocSend:
    """Return a send in which each value has a name of its own; ``namelist`` comes first."""
    listed = tuple(stmt.DocArgument(name, name) for name in send.name_list)
    written = (*listed, *send.arguments)
    if not _repeated(written):
        return send
    return replace(send, arguments=apart(written), name_list=())


def apart(arguments: tuple[stmt.DocArgument, ...]) -> tuple[stmt.DocArgument, ...]:
    """Return the same values, but the earlier ones of a name as ``name_1``, ``name_2`` ..."""
    if not _repeated(arguments):
        return arguments
    left = Counter(argument.name.value for argument in arguments)
    taken = set(left)
    found: list[stmt.DocArgument] = []
    for argument in arguments:
        name = argument.name.value
        left[name] -= 1
        if left[name]:
            own = next(n for i in count(1) if (n := f"{name}_{i}") not in taken)
            taken.add(own)
            found.append(replace(argument, name=argument.name.with_value(own)))
        else:
            found.append(argument)
    return tuple(found)


def _repeated(arguments: tuple[stmt.DocArgument, ...]) -> bool:
    return len({argument.name.value for argument in arguments}) < len(arguments)
