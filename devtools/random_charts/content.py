"""Random executable content, valid by construction."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from devtools.random_charts.choices import Choices
from devtools.random_charts.terms import LEVEL, Terms
from devtools.random_charts.vocabulary import Named, Names
from fsmkit.diagnostics import Source, Span, Text
from fsmkit.document.document import Direction
from fsmkit.language import ArrayType, BoolType, DurationType, Field, IntType, RecordType, Type
from fsmkit.language.statements import tree as stmt

SOURCE = Source("<random>", "")
PLACE = Span(SOURCE, 0, 0)
SENT = "sent"
"""The counter that bounds immediate sends to the own queue, so that `run` always ends."""
SENDS = 12
TURNS = "turns"
"""The counter that ends most loops of eventless transitions."""
MOST_TURNS = 20
DELAYS = ("1ms", "2ms", "5ms", "10ms", "10ms", "20ms", "35ms")
"""Few different delays, so that several timers often expire together."""


def is_local(variable: Named) -> bool:
    """Whether a variable is one of `Content.local`, which no loop assigns."""
    return variable.name[0] == "l" and variable.name[1:].isdigit()


def text(value: str) -> Text:
    """Return a text that stands nowhere."""
    return Text(value, PLACE)


@dataclass(frozen=True, slots=True)
class Event:
    """An event declared by the random chart."""

    name: str
    fields: tuple[Field, ...]
    directions: frozenset[Direction]
    reply: Type | None = None

    @property
    def is_received(self) -> bool:
        """Whether the machine itself can receive it."""
        return self.directions != {Direction.OUT}


@dataclass(frozen=True)
class Content:
    """Makes random statements."""

    choices: Choices
    names: Names
    events: tuple[Event, ...]
    terms: Terms = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", Terms(self.choices, self.names))

    def at(self, event: Event | None) -> Content:
        """Return the same content with `event` as the current event, whose payload it can read."""
        if event is None:
            return self
        return replace(self, names=replace(self.names, fields=event.fields))

    def block(self, *, reply: Type | None = None, most: int = 3) -> stmt.Block:
        """Return one to ``most`` statements."""
        count = self.choices.integer(1, most)
        if self.names.functions:
            return self._with_locals(count, reply)
        found = [self.statement(2) for _ in range(count)]
        if reply is not None and self.choices.chance(80):
            found.append(stmt.Reply(text(self.terms.value(reply)), PLACE))
        return tuple(found)

    def statement(self, depth: int) -> stmt.WrittenStatement:
        """Return one statement, with up to ``depth`` levels of statements in it."""
        if self.names.functions and depth > 0 and self.choices.chance(15):
            return self.counting(depth)
        kind = self.choices.integer(0, 23)
        match kind:
            case 0 | 1 | 2 | 9:
                return stmt.Log(text("at"), (text(self.terms.integer(1).text),), PLACE)
            case 3 | 4 | 5 | 6 | 7 | 8:
                return self._assign()
            case 10 | 11:
                return self._raise()
            case 12 | 13:
                return self._send_out()
            case 14 | 15 | 16:
                return self._delayed_send()
            case 17:
                return stmt.DocCancel(text(f"id{self.choices.integer(0, 2)}"), None, PLACE)
            case 18 | 19 if depth > 0:
                return self._if(depth)
            case 20 if depth > 0:
                return self._foreach(depth)
            case 21 if depth > 0:
                return self._bounded_send()
            case _:
                return self._call()

    # --- local variables: only where there are functions ----------------------------------------

    def _with_locals(self, count: int, reply: Type | None) -> stmt.Block:
        """Return statements, some of which declare what those behind them can use."""
        found: list[stmt.WrittenStatement] = []
        known = self
        for _ in range(count + 1):
            if known.choices.chance(35):
                local, known = known.local()
                found.append(local)
            else:
                found.append(known.statement(2))
        if reply is not None and known.choices.chance(80):
            found.append(stmt.Reply(text(known.terms.value(reply)), PLACE))
        return tuple(found)

    def knowing(self, *names: Named) -> Content:
        """Return the same with more variables."""
        return replace(self, names=replace(self.names, variables=(*names, *self.names.variables)))

    def fresh(self) -> str:
        """Return a name that no visible local variable has; it may exist in other blocks."""
        return f"l{sum(map(is_local, self.names.variables))}"

    def local(self) -> tuple[stmt.WrittenStatement, Content]:
        """Return a declaration, and what makes the statements behind it."""
        name = self.fresh()
        if self.choices.chance(50):
            types: tuple[Type, ...] = (IntType(0, 9), BoolType(), LEVEL, IntType(-50, 50))
            type_ = self.choices.pick(types)
            value = self.terms.value(type_, 1)
            declared = stmt.Local(text(name), text(value), PLACE, text(str(type_)))
            return declared, self.knowing(Named(name, type_))
        term = self.terms.integer(2)
        declared = stmt.Local(text(name), text(term.text), PLACE, is_fixed=True)
        return declared, self.knowing(Named(name, term.type, False, is_exact=False))

    def counting(self, depth: int) -> stmt.WrittenStatement:
        """Return a loop with variables of its own."""
        array, item, index, inner = self.head()
        return stmt.ForEach(array, item, index, (inner.statement(depth - 1),), PLACE)

    def head(self) -> tuple[Text, Text, Text | None, Content]:
        """Return array, item and index of a loop, and what makes its statements."""
        item = self.fresh()
        arrays = [v for v in self.names.of(ArrayType) if isinstance(v.type, ArrayType)]
        kind = self.choices.integer(0, 2)
        inner = self.knowing(Named(item, LEVEL, writable=False))
        array, index = "Level", None
        if kind == 1:
            lo = self.choices.integer(-3, 3)
            hi = lo + self.choices.integer(0, 4)
            array, inner = f"{lo}..{hi}", self.knowing(Named(item, IntType(lo, hi), writable=False))
        elif kind == 2 and arrays:
            chosen = self.choices.pick(arrays)
            assert isinstance(chosen.type, ArrayType)  # noqa: S101
            array = chosen.name
            inner = self.knowing(Named(item, chosen.type.element, writable=False))
            if self.choices.chance(50):
                index = inner.fresh()
                places = IntType(0, chosen.type.length - 1)
                inner = inner.knowing(Named(index, places, writable=False))
        return text(array), text(item), None if index is None else text(index), inner

    def _log(self) -> stmt.WrittenStatement:
        return stmt.Log(text("here"), (), PLACE)

    def _assign(self) -> stmt.WrittenStatement:
        writable = [v for v in self.names.variables if v.writable]
        if not writable:
            return self._log()
        target = self.choices.pick(writable)
        whole = isinstance(target.type, RecordType | ArrayType) and self.choices.chance(35)
        others = [v for v in self.terms.same(target.type) if v != target.name]
        if whole and others:
            return stmt.Assign(text(target.name), text(self.choices.pick(others)), PLACE)
        if isinstance(target.type, RecordType):
            part = self.choices.pick(target.type.fields)
            value = self.terms.value(part.type)
            return stmt.Assign(text(f"{target.name}.{part.name}"), text(value), PLACE)
        if isinstance(target.type, ArrayType):
            index = self.terms.index(target.type.length)
            value = self.terms.value(target.type.element)
            return stmt.Assign(text(f"{target.name}[{index}]"), text(value), PLACE)
        if isinstance(target.type, IntType) and self.choices.chance(40):
            operator = self.choices.pick(("+", "-", "*"))
            step = str(self.choices.integer(1, 3))
            return stmt.Assign(text(target.name), text(step), PLACE, operator)
        results = [o for o in self.names.operations if o.result == target.type]
        if results and self.choices.chance(25):
            return stmt.Assign(
                text(target.name), text(self.terms.called(self.choices.pick(results))), PLACE
            )
        return stmt.Assign(text(target.name), text(self.terms.value(target.type)), PLACE)

    def _call(self) -> stmt.WrittenStatement:
        if not self.names.operations:
            return self._log()
        return stmt.CallOperation(
            text(self.terms.called(self.choices.pick(self.names.operations))), PLACE
        )

    def _arguments(self, event: Event) -> tuple[stmt.DocArgument, ...]:
        return tuple(
            stmt.DocArgument(text(f.name), text(self.terms.value(f.type, 1))) for f in event.fields
        )

    def _raise(self) -> stmt.WrittenStatement:
        raised = [e for e in self.events if e.is_received]
        if not raised:
            return self._log()
        event = self.choices.pick(raised)
        statement: stmt.WrittenStatement = stmt.Raise(
            text(event.name), self._arguments(event), PLACE
        )
        if Direction.OUT not in event.directions and self.choices.chance(15):
            statement = self._send(event, None, "#_internal")
        if self.choices.chance(15):
            return statement
        return self._counted(TURNS, MOST_TURNS, statement)

    def _counted(
        self, counter: str, most: int, statement: stmt.WrittenStatement
    ) -> stmt.WrittenStatement:
        """Return a statement that is executed a number of times at most."""
        count = stmt.Assign(text(counter), text("1"), PLACE, "+")
        return stmt.If((stmt.Branch(text(f"{counter} < {most}"), (count, statement)),), PLACE)

    def _send_out(self) -> stmt.WrittenStatement:
        sent = [e for e in self.events if Direction.OUT in e.directions]
        if not sent:
            return self._log()
        return self._send(self.choices.pick(sent), None)

    def _delayed_send(self) -> stmt.WrittenStatement:
        if not self.events:
            return self._log()
        return self._send(self.choices.pick(self.events), self.choices.pick(DELAYS))

    def _bounded_send(self) -> stmt.WrittenStatement:
        sent = [e for e in self.events if e.directions == {Direction.IN}]
        if not sent:
            return self._log()
        return self._counted(SENT, SENDS, self._send(self.choices.pick(sent), None))

    def _send(self, event: Event, delay: str | None, target: str | None = None) -> stmt.DocSend:
        if Direction.OUT in event.directions and event.is_received:
            target = "peer"
        is_computed = delay is not None and self.names.of(DurationType) and self.choices.chance(30)
        return stmt.DocSend(
            PLACE,
            event=text(event.name),
            target=None if target is None else text(target),
            delay=None if delay is None or is_computed else text(delay),
            delay_expr=text(self.terms.duration()) if is_computed else None,
            id=text(f"id{self.choices.integer(0, 2)}")
            if delay is not None and self.choices.chance(60)
            else None,
            arguments=self._arguments(event),
        )

    def _if(self, depth: int) -> stmt.WrittenStatement:
        branches = [stmt.Branch(text(self.terms.test()), (self.statement(depth - 1),))]
        if self.choices.chance(30):
            condition = text(self.terms.boolean(1))
            branches.append(stmt.Branch(condition, (self.statement(depth - 1),)))
        if self.choices.chance(50):
            branches.append(stmt.Branch(None, (self.statement(depth - 1),)))
        return stmt.If(tuple(branches), PLACE)

    def _foreach(self, depth: int) -> stmt.WrittenStatement:
        loops = [
            (array, item)
            for array in self.names.of(ArrayType, writable=True)
            for item in self.names.variables
            if isinstance(array.type, ArrayType)
            if item.writable and item.type == array.type.element and not is_local(item)
        ]
        if not loops:
            return self._log()
        array, item = self.choices.pick(loops)
        positions = [
            v
            for v in self.names.of(IntType, writable=True)
            if v != item and isinstance(v.type, IntType) and v.type.lo <= 0 and v.type.hi >= 9
            if not is_local(v)
        ]
        index = self.choices.pick(positions) if positions and self.choices.chance(50) else None
        return stmt.ForEach(
            text(array.name),
            text(item.name),
            None if index is None else text(index.name),
            (self.statement(depth - 1),),
            PLACE,
        )
