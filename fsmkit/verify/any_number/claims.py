"""Properties over all machines of an array: ``all(i in node: ...)``, ``count(...) <= 1``.

A claim is evaluated for one machine and its neighbours at a time, so that it has the same form for
every number of machines. Everything else that a property may say is left undecided.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import cast

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.language import ContentError, RangeFault, evaluate
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.conditions import read_condition
from fsmkit.system.indices import QUANTIFIER, integer, substitute_indices
from fsmkit.system.parameters import NAME
from fsmkit.system.properties.condition import Condition
from fsmkit.system.properties.kinds import kinds
from fsmkit.system.properties.property import AtStates, Builtin, Kind
from fsmkit.system.properties.reading import property_source
from fsmkit.verify.any_number.cells import Ring
from fsmkit.verify.any_number.family import COMPARED, MOST_ENDS, Family, closing_bracket
from fsmkit.verify.any_number.terms import NotUniformError, Term, term_of
from fsmkit.verify.engines.python.evaluate import World
from fsmkit.yaml import nodes

LIMIT = re.compile(r"\s*(<=|<|>=|>)\s*(\d{1,2})\s*")
FORMS = (
    "write `all(i in node: ...)` over a machine and its neighbours, or `count(i in node: ...) <= 1`"
)


class Form(Enum):
    """The form of a claim."""

    EACH = "each"
    """The body holds for each machine."""
    AT_MOST = "at most"
    """The body holds for at most `Claim.most` machines."""
    DEADLOCK = "deadlock"


@dataclass(frozen=True, slots=True)
class Claim:
    """A property that is decided for all numbers of machines; ``why``: why it is not.

    ``body`` is a condition over the index ``variable``, in the range ``low..high`` (as written).
    ``negated``: the body must hold for no machine.
    """

    name: str
    kind: Kind | None
    text: str
    span: Span | None = None
    form: Form | None = None
    variable: str = ""
    low: Text | None = None
    high: Text | None = None
    body: Text | None = None
    negated: bool = False
    most: int = 0
    why: str = ""


def read_claims(family: Family, names: frozenset[str]) -> Iterator[Claim]:
    """Yield the claims of a family; ``names`` limits them (empty: all)."""
    has_deadlock = False
    written = {name.value for name, _ in family.entries}
    system = family.system(family.least, Findings())
    for own in system.properties:
        if own.name not in written and (not names or own.name in names):
            why = "state it in the system, as `all(i in node: ...)`"
            yield Claim(own.name, own.kind, own.text, own.span, why=why)
    for name, node in family.entries:
        claim = _claim(family, name, node)
        has_deadlock |= claim.form is Form.DEADLOCK
        if not names or claim.name in names:
            yield claim
    if not names and not has_deadlock:
        yield Claim("deadlock", None, "there is always a next step", form=Form.DEADLOCK)


def _claim(family: Family, name: Text, node: nodes.Node) -> Claim:
    if isinstance(node, nodes.Scalar):
        kind = kinds().get(node.text.value)
        form = Form.DEADLOCK if kind and kind.decided is Builtin.DEADLOCK else None
        text = "there is always a next step" if form else node.text.value
        why = "" if form else f"`{node.text}` is not decided for any number of machines"
        return Claim(name.value, kind, text, name.span, form, why=why)
    entries = [e for e in node.entries if e[0].value != "req"] if isinstance(
        node, nodes.Mapping) else []  # fmt: skip
    key, value = entries[0] if entries else (name, node)
    kind = kinds().get(key.value)
    text = property_source(value)
    if kind is not None and kind.decided is Builtin.DEADLOCK:
        return Claim(name.value, kind, "there is always a next step", name.span, Form.DEADLOCK)
    plain = Claim(name.value, kind, text, name.span, why=FORMS)
    is_state = kind is not None and isinstance(kind.decided, AtStates)
    if not is_state or len(entries) != 1 or not isinstance(value, nodes.Scalar):
        return Claim(
            name.value, kind, text, name.span,
            why=f"`{key}` is not decided for any number of machines",
        )  # fmt: skip
    assert kind is not None and isinstance(kind.decided, AtStates)  # noqa: S101, PT018
    if kind.decided.existential:
        return Claim(
            name.value, kind, text, name.span,
            why=f"`{key}` is not decided for any number of machines",
        )  # fmt: skip
    try:
        return _quantified(family, plain, value.text, is_never=not kind.decided.negated)
    except NotUniformError as error:
        return Claim(name.value, kind, text, name.span, why=str(error))


def _quantified(family: Family, plain: Claim, text: Text, *, is_never: bool) -> Claim:
    match = QUANTIFIER.match(text.value.strip())
    text = text.strip()
    end = None if match is None else closing_bracket(text.value, match.end(), "(", ")")
    if match is None or end is None or end >= len(text.value):
        return plain
    rest = text.value[end + 1 :]
    word = match[1]
    low, high = _range(family, text.part(*match.span(3)))
    claim = Claim(
        plain.name, plain.kind, plain.text, plain.span, Form.EACH, match[2], low, high,
        text.part(match.end(), end), negated=is_never,
    )  # fmt: skip
    if word == "count":
        limit = LIMIT.fullmatch(rest)
        if limit is None or (limit[1] in ("<", "<=")) is is_never:
            return plain
        most = int(limit[2]) - (limit[1] in ("<", ">="))
        claim = Claim(
            plain.name, plain.kind, plain.text, plain.span, Form.AT_MOST, match[2], low, high,
            claim.body, most=most,
        )  # fmt: skip
    elif rest.strip() or (word == "any") is not is_never:
        return plain
    _check_body(family, claim)
    return claim


def _range(family: Family, text: Text) -> tuple[Text, Text]:
    """Return the ends of the range of a quantifier."""
    if text.value.strip() in family.arrays:
        return text.with_value(str(family.low)), text.with_value(
            f"{family.parameter} + {family.high}"
        )
    low, dots, _ = text.value.partition("..")
    if not dots:
        raise NotUniformError(f"`{text}` is no array over `{family.parameter}`", text.span)
    return text.part(0, len(low)), text.part(len(low) + 2, len(text.value))


def _check_body(family: Family, claim: Claim) -> None:
    """Require that a body is uniform: indices near the index of the quantifier, and no others."""
    assert claim.body and claim.low and claim.high  # noqa: S101, PT018  (quantified)
    ends = family.ends
    while True:
        before = (ends.low, ends.high)
        for place in family.places():
            _check_body_at(family, claim, place)
        if before == (ends.low, ends.high):
            return


def _check_body_at(family: Family, claim: Claim, place: Term) -> None:
    assert claim.body and claim.low and claim.high  # noqa: S101, PT018  (quantified)
    ends = family.ends
    names = family.names_at(place)
    low, high = (term_of(text, names, ends) for text in (claim.low, claim.high))
    if not (isinstance(low, Term) and isinstance(high, Term)):
        raise NotUniformError("its range has no numbers", claim.body.span)
    last = high.plus(Term(length=1, constant=-1 + family.low), -1)
    if not low.is_constant or not last.is_constant:
        raise NotUniformError("its range is not that of the array", claim.body.span)
    if low.constant < family.low or last.constant > 0:
        raise NotUniformError("its range is longer than the array", claim.body.span)
    ends.low = max(ends.low, low.constant - family.low)
    ends.high = max(ends.high, -last.constant)
    if max(ends.low, ends.high) > MOST_ENDS:
        raise NotUniformError("its range is much shorter than the array", claim.body.span)
    names[claim.variable] = place.plus(Term(constant=family.low))
    rest = claim.body.value
    if QUANTIFIER.search(rest):
        raise NotUniformError("it has a quantifier within a quantifier", claim.body.span)
    for match in reversed(list(re.finditer(r"\[([^\[\]]*)\]", rest))):
        term_of(claim.body.part(*match.span(1)), names, ends)
        rest = rest[: match.start()] + rest[match.end() :]
    for match in COMPARED.finditer(rest):
        if match[1] in family.ids and match[2].isdecimal() and int(match[2]) < family.low:
            rest = rest.replace(match[0], " ", 1)
    if set(NAME.findall(rest)).intersection(family.ids):
        raise NotUniformError("it compares the number of a machine", claim.body.span)
    used = set(NAME.findall(re.sub(r"\bIn\s*\([^()]*\)|\.\s*\w+", "", rest)))
    if used & {claim.variable, family.parameter}:
        raise NotUniformError("it uses a number of a machine beside an index", claim.body.span)
    if "occurs" in used:
        raise NotUniformError("it is about steps", claim.body.span)


@dataclass(frozen=True, slots=True)
class Instance:
    """The body of a claim for one machine: the first position that it reads, and how many."""

    start: int
    size: int
    anchor: int
    condition: Condition


class Instances:
    """The bodies of a claim for all machines of a ring."""

    def __init__(self, ring: Ring, claim: Claim) -> None:
        """Read the conditions. Raises `FsmkitError` if one is wrong."""
        assert claim.body and claim.low and claim.high  # noqa: S101, PT018  (quantified)
        self.ring, self.claim = ring, claim
        findings = Findings()
        bindings = {ring.family.parameter: ring.family.value(ring.length)}
        low, high = (integer(text, findings, bindings) for text in (claim.low, claim.high))
        findings.stop_on_errors()
        assert low is not None and high is not None  # noqa: S101, PT018  (no error)
        self.all: list[Instance] = []
        machines = ring.closed.system.machines
        for index in range(low, high + 1):
            text = substitute_indices(claim.body, {**bindings, claim.variable: index})
            condition = read_condition(text, machines, findings)
            findings.stop_on_errors()
            if condition is not None:
                self.all.append(self._instance(index - ring.family.low, condition))

    def _instance(self, anchor: int, condition: Condition) -> Instance:
        """Return an instance; it reads all positions between the outermost ones."""
        ring = self.ring
        distances = [
            ring.distance(anchor, ring.position[atom.machine]) for _, atom in condition.atoms
        ]
        first, last = min(distances, default=0), max(distances, default=0)
        return Instance((anchor + first) % ring.length, last - first + 1, anchor, condition)

    @property
    def width(self) -> int:
        """The greatest number of positions that one of them reads."""
        return max((each.size for each in self.all), default=1)

    @property
    def first(self) -> Instance | None:
        """The body for the first machine, if it reads no other one and exists for all machines."""
        found = next((each for each in self.all if each.anchor == 0), None)
        is_whole = len(self.all) == self.ring.length
        return found if found is not None and found.size == 1 and is_whole else None

    def holds(self, instance: Instance, snapshots: Mapping[int, Snapshot]) -> bool:
        """Return whether the body holds, given the machines that it reads."""
        by_machine = cast("Sequence[Snapshot]", snapshots)
        whole = World(self.ring.closed.charts, by_machine, atoms=instance.condition.atoms)
        try:
            found = bool(evaluate(instance.condition.expression, whole))
        except (ContentError, RangeFault):  # the whole property counts as false
            found = self.claim.negated or self.claim.form is Form.AT_MOST
        return found
