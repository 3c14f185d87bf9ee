"""Actions, guards and delays of XState as statements and expressions of a chart."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.foreign.imports import OpaqueContent, Recorder, Remark, Role, reject
from fsmkit.foreign.words import RESERVED
from fsmkit.foreign.xstate.expressions import (
    BOOL,
    INT,
    NUMBERS,
    Scope,
    Translation,
    Typed,
    function_of,
    literal,
    translate,
)
from fsmkit.foreign.xstate.machine import Machine
from fsmkit.foreign.xstate.script import arguments
from fsmkit.foreign.xstate.values import (
    Array,
    Call,
    Code,
    Constant,
    Number,
    Record,
    String,
    Value,
    is_absent,
    items,
)

POSTS = re.compile(
    r"\b(?:send|sendTo|raise|emit|forwardTo|sendParent|spawn|enqueue\w*|trigger)\b\s*[.(]"
)
"""Code that posts events or starts actors."""
SENDERS = {"sendTo": 1, "sendParent": 0, "emit": 0, "forwardTo": 1}
"""Actions that send an event elsewhere, and the argument that is the event."""
DEEPEST = 20
"""Implementations that name other implementations."""


@dataclass
class Names:
    """Different identifiers for different texts."""

    taken: set[str] = field(default_factory=set)
    given: dict[str, str] = field(default_factory=dict)

    def name(self, text: str, base: str | None = None) -> str:
        """Return the identifier of a text, made of ``base`` where it is new."""
        if text not in self.given:
            self.given[text] = self.fresh(base or text)
        return self.given[text]

    def fresh(self, base: str) -> str:
        """Return a new identifier that resembles a text."""
        plain = re.sub(r"\W", "_", base, flags=re.ASCII).strip("_") or "x"
        plain = f"x_{plain}" if plain[0].isdigit() else plain[:60]
        name, number = plain, 1
        while name in self.taken or name in RESERVED:
            number += 1
            name = f"{plain}_{number}"
        self.taken.add(name)
        return name


ROLES: dict[str | None, Role] = {BOOL: Role.GUARD, "duration": Role.DELAY}


@dataclass(frozen=True, slots=True)
class Guard:
    """A condition. ``is_pure``: no operation of the host decides it."""

    text: str
    is_pure: bool = True


@dataclass
class Content:
    """Translates the content of one machine and collects what it declares.

    ``demoted`` are variables of the context that the host keeps, because some code assigns them;
    a translation adds to it, and the machine is then translated once more.
    """

    machine: Machine
    demoted: set[str]
    findings: Findings
    recorder: Recorder = field(default_factory=Recorder)
    opaque: dict[str, OpaqueContent] = field(default_factory=dict)
    names: Names = field(default_factory=Names)
    events: Names = field(default_factory=Names)
    operations: dict[str, tuple[tuple[tuple[str, str], ...], str | None]] = field(
        default_factory=dict
    )
    fields: dict[str, dict[str, str]] = field(default_factory=dict)
    """The types of the fields of each event, by its name in the chart."""
    out: dict[str, Span] = field(default_factory=dict)
    raised: dict[str, Span] = field(default_factory=dict)
    delayed: int = 0

    def __post_init__(self) -> None:
        self.variables = dict(self._read_context())

    def reject(self, message: str, at: Span | Text, advice: str) -> None:
        """Report a construct that no chart expresses."""
        reject(self.findings, message, at, advice)

    # --- context ------------------------------------------------------------------------------

    def _read_context(self) -> Iterator[tuple[str, tuple[Typed, str]]]:
        """Yield the variables of the context: name, the variable in the chart, start value."""
        context = self.machine.context
        if isinstance(context, Code):
            found = function_of(context.script, context.node)
            context = None if found is None else context.script.value(found[1])
        if not isinstance(context, Record):
            return
        for key, value in context.fields:
            start = literal(value)
            if start is None or key.value in self.demoted:
                self.recorder.lose(f"`context.{key}`, which the host keeps", key.span)
                continue
            name = self.names.fresh(key.value)
            if start.type in NUMBERS:
                message = (
                    f"`context.{key}` has the type {start.type}; the library has one of numbers"
                )
                self.recorder.differs.append(Remark(message, key.span))
            yield key.value, (Typed(name, start.type, is_atom=True), start.text)

    def scope(self, events: Iterable[str] | None, params: Record | None = None) -> Scope:
        """Return the names that content can read while one of some events is current."""
        variables = {name: typed for name, (typed, _) in self.variables.items()}
        fields: dict[str, str] | None = None
        names = tuple(events or ())
        if len(names) == 1:
            fields = self.fields.setdefault(names[0], {})
        elif names:
            declared = [self.fields.setdefault(name, {}) for name in names]
            first = declared[0]
            is_like = all(each == first for each in declared)
            fields = first if is_like else None
            for name in names if is_like else ():
                self.fields[name] = first  # from here on they have the same fields
        given = {} if params is None else {key.value: value for key, value in params.fields}
        return Scope(variables, fields, given)

    # --- guards -------------------------------------------------------------------------------

    def guard(
        self,
        value: Value | None,
        events: tuple[str, ...] | None,
        where: str,
        states: dict[int, str],
        depth: int = 0,
        params: Record | None = None,
    ) -> Guard | None:
        """Return the condition of a guard; None without a guard."""
        if value is None:
            return None
        if depth > DEEPEST:
            self.reject("guards name each other more than 20 levels deep", value.span, "simplify")
            return None
        match value:
            case String(text):
                return self._named_guard(text, None, events, where, states, depth)
            case Record() if isinstance(name := value.get("type"), String):
                given = value.get("params")
                if given is not None and not isinstance(given, Record):
                    return self._opaque_guard(value, f"{name.text}_{where}")
                return self._named_guard(name.text, given, events, where, states, depth)
            case Call(name, found) if name in ("and", "or") and len(found) == 1:
                parts = [
                    self.guard(each, events, where, states, depth + 1, params)
                    for each in items(found[0])
                ]
                kept = [each for each in parts if each is not None]
                joined = f" {name} ".join(f"({each.text})" for each in kept)
                return Guard(joined or "true", all(each.is_pure for each in kept))
            case Call("not", found) if len(found) == 1:
                inner = self.guard(found[0], events, where, states, depth + 1, params)
                return None if inner is None else Guard(f"not ({inner.text})", inner.is_pure)
            case Call("stateIn", found) if len(found) == 1:
                return self._state_in(found[0], states)
            case Constant(True):
                return Guard("true")
            case Code():
                found_text = translate(value, self.scope(events, params), BOOL)
                if found_text is not None:
                    return Guard(found_text.text)
                return self._opaque_guard(value, where)
            case _:
                return self._opaque_guard(value, where)

    def _named_guard(
        self,
        name: Text,
        params: Record | None,
        events: tuple[str, ...] | None,
        where: str,
        states: dict[int, str],
        depth: int,
    ) -> Guard | None:
        known = self.machine.implementations.get("guards")
        given = None if known is None else known.get(name.value)
        if isinstance(given, Call | String | Record):
            return self.guard(given, events, where, states, depth + 1, params)
        if isinstance(given, Code):
            found = translate(given, self.scope(events, params), BOOL)
            if found is not None:
                return Guard(found.text)
        text = name.value if given is None else f"{name}: {_shown(given)}"
        operation, passed = self._operation(name.value, params, text, BOOL, name.span)
        return Guard(f"{operation}({passed})", is_pure=False)

    def _opaque_guard(self, value: Value, base: str) -> Guard:
        self._check_posts(value)
        operation, _ = self._operation(f"{base}_guard", None, _shown(value), BOOL, value.span)
        return Guard(f"{operation}()", is_pure=False)

    def _state_in(self, value: Value, states: dict[int, str]) -> Guard | None:
        paths: list[tuple[str, ...]] = []

        def collect(base: tuple[str, ...], one: Value) -> None:
            match one:
                case String(text):
                    paths.append((*base, *text.value.split(".")))
                case Record(fields):
                    for key, inner in fields:
                        collect((*base, key.value), inner)
                    if not fields:
                        paths.append(base)
                case _:
                    self.reject("the state is computed", one.span, "name it")

        if isinstance(value, String) and value.text.value.startswith("#"):
            found = [s.index for s in self.machine.states if s.id == value.text.value[1:]]
        else:
            collect((), value)
            known = {state.path: state.index for state in self.machine.states}
            found = [known[path] for path in paths if path in known]
            if len(found) != len(paths):
                found = []
        if not found:
            self.reject("`stateIn` names no state of the machine", value.span, "name one by `#id`")
            return None
        return Guard(" and ".join(f"In({states[each]})" for each in found))

    # --- actions ------------------------------------------------------------------------------

    def actions(
        self,
        values: Iterable[Value],
        events: tuple[str, ...] | None,
        where: str,
        params: Record | None = None,
        depth: int = 0,
    ) -> list[str]:
        """Return the statements of some actions, in order."""
        found: list[str] = []
        for value in values:
            if depth > DEEPEST:
                self.reject("actions name each other more than 20 levels deep", value.span,
                            "simplify")  # fmt: skip
                break
            found += self._action(value, events, where, params, depth)
        return found

    def _action(
        self,
        value: Value,
        events: tuple[str, ...] | None,
        where: str,
        params: Record | None,
        depth: int,
    ) -> list[str]:
        match value:
            case String(text):
                return self._named_action(text, None, events, where, depth, value)
            case Record() if isinstance(name := value.get("type"), String):
                if name.text.value.startswith("xstate."):
                    self.reject(f"the action `{name.text}` lost its content when it was written "
                                "as JSON", name.text, "read the program instead")  # fmt: skip
                    return []
                given = value.get("params")
                if given is None or isinstance(given, Record):
                    return self._named_action(name.text, given, events, where, depth, value)
                return self._opaque_action(value, name.text.value)
            case Call("assign", (given, *_)):
                return self._assign(given, events, where, params)
            case Call("raise", (given, *rest)):
                return self._raise(given, rest, events, params)
            case Call("cancel", (String(text), *_)):
                return [f"cancel {self.names.name(f'id {text}', text.value)}"]
            case Call("log", given):
                if given and isinstance(label := given[0], String):
                    return [f"log {_quoted(label.text.value)}"]
                self.recorder.lose("a computed log", value.span)
                return []
            case Call(name, given) if name in SENDERS and len(given) > SENDERS[name]:
                return self._send(name, given, events, params)
            case Call(name) if name in ("assign", "raise", "cancel", *SENDERS):
                self.reject(f"`{name}` is computed when the program runs", value.span,
                            "write its arguments as literals")  # fmt: skip
                return []
            case Call("enqueueActions" | "spawnChild" | "stopChild" | "stop" | "pure" | "choose"):
                self.reject(f"`{value.name}` decides when the program runs which actions or actors "
                            "there are", value.span, "list the actions, each with a transition "
                            "and a guard; use `invoke` for actors")  # fmt: skip
                return []
            case _:
                return self._opaque_action(value, where)

    def _named_action(
        self,
        name: Text,
        params: Record | None,
        events: tuple[str, ...] | None,
        where: str,
        depth: int,
        value: Value,
    ) -> list[str]:
        known = self.machine.implementations.get("actions")
        given = None if known is None else known.get(name.value)
        if isinstance(given, Call | Array | String):
            return self.actions(items(given), events, where, params, depth + 1)
        if given is not None:
            self._check_posts(given)
        text = name.value if given is None else f"{name}: {_shown(given)}"
        operation, passed = self._operation(name.value, params, text, None, value.span)
        return [f"{operation}({passed})"]

    def _opaque_action(self, value: Value, base: str) -> list[str]:
        self._check_posts(value)
        name = value.text if isinstance(value, Code) and value.text.isidentifier() else base
        operation, _ = self._operation(name, None, _shown(value), None, value.span)
        return [f"{operation}()"]

    def _check_posts(self, value: Value) -> None:
        if POSTS.search(_shown(value)):
            self.reject("this code posts an event, or starts an actor, when it runs", value.span,
                        "use `raise({type: ...})`, `sendTo` or `invoke`")  # fmt: skip

    def _operation(
        self, base: str, params: Record | None, text: str, result: str | None, span: Span
    ) -> tuple[str, str]:
        """Declare an operation; return its name and the arguments of a call with ``params``."""
        typed = [
            (self._parameter(key.value), found)
            for key, value in (() if params is None else params.fields)
            if (found := literal(value)) is not None
        ]
        signature = tuple((name, each.type) for name, each in typed)
        key = f"{result} {text} {signature}"
        name = self.names.name(key, base)
        self.operations[name] = (signature, result)
        self.note_opaque(name, text, span, ROLES.get(result, Role.ACTION))
        return name, ", ".join(each.text for _, each in typed)

    def note_opaque(self, name: str, text: str, span: Span, role: Role = Role.ACTION) -> None:
        """Record what an operation of the host represents."""
        self.opaque.setdefault(name, OpaqueContent(name, Text(text, span, ()), role))

    def _parameter(self, name: str) -> str:
        return self.names.name(f"parameter {name}", name)

    def _assign(
        self,
        given: Value,
        events: tuple[str, ...] | None,
        where: str,
        params: Record | None,
    ) -> list[str]:
        scope = self.scope(events, params)
        parts: list[tuple[str, Typed | None, Value]] = []
        match given:
            case Record(fields):
                for key, value in fields:
                    variable = self.variables.get(key.value)
                    expected = None if variable is None else variable[0].type
                    found = literal(value)
                    if isinstance(value, Code) and variable is not None:
                        found = translate(value, scope, expected)
                    parts.append((key.value, found, value))
            case Code():
                listed = self._returned(given, scope)
                if listed is None:
                    self.demoted.update(self.variables)
                    return self._opaque_action(given, f"assign_{where}")
                parts = listed
            case _:
                self.reject("the assignment is computed when the program runs", given.span,
                            "write `assign({name: value})`")  # fmt: skip
                return []
        return self._assignments(parts, given)

    def _returned(self, code: Code, scope: Scope) -> list[tuple[str, Typed | None, Value]] | None:
        """Return the assignments of a function that returns an object literal."""
        found = function_of(code.script, code.node)
        if found is None or found[1].type != "object":
            return None
        translation = Translation(code.script, found[0], scope)
        parts: list[tuple[str, Typed | None, Value]] = []
        for pair in arguments(found[1]):
            if pair.type == "spread_element":
                if translation.path(pair.named_children[0]) == ("context",):
                    continue
                return None
            if pair.type != "pair":
                return None
            key = code.script.text(pair.child_by_field_name("key")).strip("'\"")
            variable = self.variables.get(key)
            node = pair.child_by_field_name("value")
            typed = translation.expression(node, None if variable is None else variable[0].type)
            parts.append((key, typed, Code(code.script.span(node), code.script, node)))
        return parts

    def _assignments(self, parts: list[tuple[str, Typed | None, Value]], given: Value) -> list[str]:
        """Return assignments that happen at the same time; others become one operation."""
        kept: list[tuple[Typed, Typed]] = []
        opaque: list[str] = []
        for name, value, _ in parts:
            variable = self.variables.get(name)
            if variable is not None and value is not None and _fits(value, variable[0]):
                kept.append((variable[0], value))
            else:
                opaque.append(name)
                if variable is not None:
                    self.demoted.add(name)
        found: list[str] = []
        is_ordered = all(
            re.search(rf"\b{variable.text}\b", value.text) is None
            for number, (variable, _) in enumerate(kept)
            for _, value in kept[number + 1 :]
        )
        if is_ordered:
            found += [f"{variable.text} = {value.text}" for variable, value in kept]
        else:
            new = [self.names.fresh(f"new_{variable.text}") for variable, _ in kept]
            found += [
                f"let {name} = {value.text}" for name, (_, value) in zip(new, kept, strict=True)
            ]
            found += [f"{v.text} = {name}" for name, (v, _) in zip(new, kept, strict=True)]
        if opaque:
            self._check_posts(given)
            base = f"assign_{'_'.join(opaque)}"
            operation, _ = self._operation(base, None, _shown(given), None, given.span)
            found.append(f"{operation}()")
        return found

    # --- events -------------------------------------------------------------------------------

    def _event(
        self, given: Value, events: tuple[str, ...] | None, params: Record | None
    ) -> tuple[Text, dict[str, Typed]] | None:
        """Return the type and the payload of an event; None where it is computed."""
        if isinstance(given, Code):
            found = function_of(given.script, given.node)
            if found is not None and found[1].type == "object":
                record = given.script.value(found[1])
                translation = Translation(given.script, found[0], self.scope(events, params))
                if isinstance(record, Record):
                    return self._payload(record, translation)
            return None
        if isinstance(given, String):
            return given.text, {}
        return self._payload(given, None) if isinstance(given, Record) else None

    def _payload(
        self, record: Record, translation: Translation | None
    ) -> tuple[Text, dict[str, Typed]] | None:
        kind = record.get("type")
        if not isinstance(kind, String):
            return None
        found: dict[str, Typed] = {}
        for key, value in record.fields:
            if key.value == "type" or is_absent(value):
                continue
            typed = literal(value)
            if typed is None and isinstance(value, Code) and translation is not None:
                typed = translation.expression(value.node)
            if typed is None or not key.value.isidentifier():
                self.recorder.lose(f"`{key}` of the event `{kind.text}`", key.span)
                continue
            found[key.value] = typed
        return kind.text, found

    def _raise(
        self,
        given: Value,
        rest: list[Value],
        events: tuple[str, ...] | None,
        params: Record | None,
    ) -> list[str]:
        event = self._event(given, events, params)
        if event is None:
            self.reject("the raised event is computed when the program runs", given.span,
                        "write `raise({type: 'NAME'})`")  # fmt: skip
            return []
        name = self.events.name(event[0].value)
        self.raised.setdefault(name, event[0].span)
        passed = self._arguments(name, event[1])
        options = rest[0] if rest and isinstance(rest[0], Record) else None
        delay = None if options is None else options.get("delay")
        if delay is None or options is None:
            return [f"raise {name}{passed}"]
        time = self.delay(delay, f"raise_{name}")
        self.delayed += 1
        mark = options.get("id")
        label = ""
        if isinstance(mark, String):
            label = f" as {self.names.name(f'id {mark.text}', mark.text.value)}"
        return [f"send {name}{passed} after {time}{label}"]

    def _arguments(self, event: str, payload: dict[str, Typed]) -> str:
        fields = self.fields.setdefault(event, {})
        for name, typed in payload.items():
            fields.setdefault(name, typed.type)
        if not payload:
            return ""
        return f"({', '.join(f'{name} = {typed.text}' for name, typed in payload.items())})"

    def _send(
        self,
        sender: str,
        given: tuple[Value, ...],
        events: tuple[str, ...] | None,
        params: Record | None,
    ) -> list[str]:
        at = SENDERS[sender]
        event = self._event(given[at], events, params)
        if event is None or sender == "forwardTo":
            self.reject("the sent event is computed when the program runs", given[at].span,
                        "write `{type: 'NAME'}`")  # fmt: skip
            return []
        to = given[0] if at == 1 else None
        if isinstance(to, Code) and re.search(r"\bself\b", to.text):
            self.reject("the machine sends an event to itself", to.span, "use `raise`")
            return []
        options = given[at + 1] if len(given) > at + 1 else None
        if isinstance(options, Record) and options.get("delay") is not None:
            self.reject("the event is sent to another actor after a delay", given[at].span,
                        "let a state wait with `after`")  # fmt: skip
            return []
        receiver = to.text.value if isinstance(to, String) else "" if to is None else "actor"
        base = f"{receiver}_{event[0]}" if receiver else event[0].value
        name = self.events.name(f"out {receiver} {event[0]}", base)
        self.out.setdefault(name, event[0].span)
        return [f"send {name}{self._arguments(name, event[1])}"]

    # --- delays -------------------------------------------------------------------------------

    def delay(self, value: Value, where: str) -> str:
        """Return a delay as a duration: a literal, or a call of an operation."""
        if isinstance(value, String) and not _is_number(value.text.value):
            known = self.machine.implementations.get("delays")
            given = None if known is None else known.get(value.text.value)
            where = value.text.value
            value = value if given is None else given
        if isinstance(value, Number):
            return f"{value.value}ms"
        if isinstance(value, String) and _is_number(value.text.value):
            return f"{value.text}ms"
        self._check_posts(value)
        text = value.text.value if isinstance(value, String) else _shown(value)
        operation, _ = self._operation(where, None, text, "duration", value.span)
        return f"{operation}()"


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[0-9]{1,12}", text) is not None


def _fits(value: Typed, variable: Typed) -> bool:
    return value.type == variable.type or (value.type, variable.type) == (INT, "float64")


def _shown(value: Value) -> str:
    """Return the source text of a value, on one line."""
    span = value.span
    return " ".join(span.source.text[span.start : span.end].split())


def _quoted(text: str) -> str:
    shown = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f\x7f]", " ", shown) + '"'
