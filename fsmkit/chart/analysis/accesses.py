"""Reads and writes of a chart's variables by executable content."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from fsmkit.chart.analysis.effects import can_end, can_fail
from fsmkit.chart.content import values, variables, written
from fsmkit.chart.statements import Block, CallOperation, ForEach, If, Invoke, Send, Statement
from fsmkit.language import Call, EventField, EventName, Location, Variable
from fsmkit.language.walk import nodes, root

Names = frozenset[str]
NONE: Names = frozenset()


@dataclass(frozen=True, slots=True)
class Accesses:
    """The reads and writes of some content.

    ``reads``: their values from before may be read. ``certain``: they are written, whole, whatever
    happens. ``written``: they may be, or parts of them.
    """

    reads: Names = NONE
    certain: Names = NONE
    written: Names = NONE

    def then(self, later: Accesses) -> Accesses:
        """Return the accesses of two parts that run one after the other."""
        return Accesses(
            self.reads | (later.reads - self.certain),
            self.certain | later.certain,
            self.written | later.written,
        )

    def restricted_to(self, names: Names) -> Accesses:
        """Return the accesses to the variables in `names` only."""
        return Accesses(self.reads & names, self.certain & names, self.written & names)


def accesses(block: Block, fields: Names = NONE) -> Accesses:
    """Return the accesses of a block; reading ``fields`` of the current event cannot fail."""
    scan = _Scan(fields)
    scan.block(block)
    return Accesses(frozenset(scan.reads), frozenset(scan.certain), frozenset(scan.touched))


@dataclass(slots=True)
class _Scan:
    """Goes through a block. Where an expression cannot be evaluated, the rest is skipped."""

    fields: Names
    reads: set[str] = field(default_factory=set)
    touched: set[str] = field(default_factory=set)
    written: set[str] = field(default_factory=set)
    """Written on all ways that come to this point."""
    certain: set[str] = field(default_factory=set)
    """Written before anything could fail."""
    is_sure: bool = True
    """Nothing before this point can fail."""

    def block(self, statements: Iterable[Statement]) -> None:
        for statement in statements:
            self._statement(statement)

    def _statement(self, statement: Statement) -> None:
        match statement:
            case If(branches):
                self._branches([(b.condition, b.body) for b in branches])
            case ForEach(item=item, index=index, body=body):
                self._evaluate(values(statement))
                assigned = {item.name} | (set() if index is None else {index.name})
                inner_ = self._copy()
                inner_.written |= assigned
                inner_.block(body)
                self.touched |= inner_.touched | assigned
                self.reads |= inner_.reads
                self.is_sure = inner_.is_sure
            case _:
                self._evaluate(values(statement))
                is_lasting = isinstance(statement, CallOperation | Invoke) or (
                    isinstance(statement, Send) and statement.delay is not None
                )
                self.is_sure = self.is_sure and not is_lasting and not can_end(statement)
                for place in written(statement):
                    self._write(place)

    def _branches(self, branches: list[tuple[object | None, tuple[Statement, ...]]]) -> None:
        ways = []
        for condition, body in branches:
            if condition is not None:
                self._evaluate(condition)
            way = self._copy()
            way.block(body)
            ways.append(way)
        if all(condition is not None for condition, _ in branches):
            ways.append(self._copy())
        for way in ways:
            self.reads |= way.reads
            self.touched |= way.touched
        self.written = set.intersection(*(way.written for way in ways))
        self.certain = set.intersection(*(way.certain for way in ways))
        self.is_sure = all(way.is_sure for way in ways)

    def _copy(self) -> _Scan:
        return _Scan(
            self.fields,
            set(self.reads),
            set(self.touched),
            set(self.written),
            set(self.certain),
            self.is_sure,
        )

    def _evaluate(self, node: object) -> None:
        self.reads |= variables(node) - self.written
        self.is_sure = (
            self.is_sure
            and not can_fail(node)
            and not any(map(self._has_unknown_value, nodes(node)))
        )

    def _write(self, place: Location) -> None:
        self.touched.add(root(place).name)
        if isinstance(place, Variable):
            self.written.add(place.name)
            if self.is_sure:
                self.certain.add(place.name)

    def _has_unknown_value(self, part: object) -> bool:
        """Whether it depends on the host, or on a current event, that the part has a value."""
        is_unknown = isinstance(part, EventField) and part.name not in self.fields
        return is_unknown or isinstance(part, Call | EventName)
