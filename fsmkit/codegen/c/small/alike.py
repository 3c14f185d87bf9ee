"""One body for all copies of a used chart: handlers that differ in numbers and data are one.

States of a chart follow each other in document order, so copies of equal size have numbers that
differ by a constant; so have their transitions and events. Bodies are compared as they are printed,
word by word: what differs becomes an expression of ``copy``, the number of the copy. Where that
cannot be (each copy calls a function of the host of its own), a statement becomes a ``switch``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.codegen.c.ir import OWN, OWN_UPPER, Unit
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.document.document import Kind

Lines = tuple[str, ...]
Shape = tuple[tuple[Kind, int, int], ...]
"""Of each state of a copy: its kind, how many transitions and children it has."""
MEMBER = "\x03"
"""After the address of a struct, until it is known that one of its members is meant."""
COPY = "copy"
"""What the number of a copy is called where a body is that of several."""
LINE, READ, TABLE = 12, 12, 16
"""Bytes of a line or a call, of a body that computes with `COPY`, of reading that from a table
(Cortex-M0, gcc -Os, on the average); an entry of the table is one byte."""
_NUMBERED = rf"{OWN}_(?:block|guard)_\d+\(m\)"
_WORD = re.compile(
    rf"{_NUMBERED}|m->(?:data|in|out|fsm)\.\w+|\.of\.\w+|\[\d+\]"
    rf"|[{OWN}{OWN_UPPER}]?\w+|\s+|\"(?:\\.|[^\"\\])*\"|."
)
_LOCAL = re.compile(r"(?<![\w.>])let_\w+")
_RAISED = re.compile(r"(_raise_plain\(m, )\(uint\d+_t\)")
"""The one function that takes an event as what hosts call it, for which C++ wants its type."""
_STATEMENT = re.compile(r"(\s*)(?:return .*|\(void\)\S+\(.*\)|\S+\(.*\)|[^ ()]+ = .*);")


@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands in a copy: equal in all copies of a group but for ``copy``."""

    group: int
    copy: int
    inner: tuple[int, ...]


def copies_of(chart: Chart) -> tuple[tuple[tuple[int, ...], int], ...]:
    """Return the groups of copies: their states, in document order, and how many states each has.

    Copies of a group are of one chart and have as many states; their numbers differ by a constant.
    """
    kinds: dict[tuple[str, Shape], list[int]] = {}
    for copy in chart.copies:
        states = chart.states[copy.state : chart.states[copy.state].last_descendant + 1]
        shape = tuple((s.kind, len(s.transitions), len(s.children)) for s in states)
        kinds.setdefault((copy.chart, shape), []).append(copy.state)
    groups = []
    taken: set[int] = set()
    for (_, shape), found in sorted(kinds.items(), key=lambda each: each[1][0]):
        bases = [base for base in found if base not in taken]
        step = bases[1] - bases[0] if len(bases) > 1 else 0
        evenly = [base for n, base in enumerate(bases) if base == bases[0] + n * step]
        if 1 < len(evenly) <= NARROW:
            groups.append((tuple(evenly), len(shape)))
            taken |= {base + n for base in evenly for n in range(len(shape))}
    return tuple(groups)


class Alike:
    """Merges the bodies of copies of one machine."""

    def __init__(self, names: Names, functions: Sequence[Unit]) -> None:
        """Begin; ``functions``: where those of blocks and guards are defined."""
        self._names = names
        self._functions = functions
        self._groups = copies_of(names.chart) if names.chart.copies else ()
        self._merged: dict[tuple[str, ...], str | None] = {}
        self._structs = self._members() if self._groups else {}
        self._numbers = self._enumerators() if self._groups else {}
        self._same = self._interchangeable() if self._groups else {}

    def _enumerators(self) -> dict[str, int]:
        names = self._names
        found = {name: number for number, name in enumerate(names.states)}
        found |= {name: number for number, name in enumerate(names.events, 1)}
        return found | {name: number for number, name in names.timers.items()}

    def _members(self) -> dict[str, str]:
        """Return the type of each member of the machine that holds what a copy has."""
        structs = self._names.structs
        return {
            f"m->{group}.{part.name}": part.struct.name
            for group, parts in (() if structs is None else structs.members.items())
            for part in parts
            if part.struct is not None and not part.count
        }

    def _interchangeable(self) -> dict[str, object]:
        """Return words that stand for the same in several copies, by what they stand for."""
        names, chart = self._names, self._names.chart
        found: dict[str, object] = {
            names.constants[name]: (str(value.type), value.value)
            for name, value in chart.constants
            if name in names.constants
        }
        return found | {
            f".of.{names.payloads[event.index]}": event.fields
            for event in chart.events
            if event.fields
        }

    def place(self, state: int, *more: int) -> Place | None:
        """Return where a state stands, or something of it; None outside of copies."""
        for group, (bases, size) in enumerate(self._groups):
            for copy, base in enumerate(bases):
                if base <= state < base + size:
                    return Place(group, copy, (state - base, *more))
        return None

    def transition(self, index: int) -> Place | None:
        """Return where a transition stands."""
        chart = self._names.chart
        source = chart.transitions[index].source
        own = chart.states[source].transitions
        return self.place(source, 1, own.index(index)) if index in own else None

    def copies(self, places: Sequence[Place | None]) -> list[int]:
        """Return the numbers of copies; 0 outside of them."""
        return [0 if place is None else place.copy for place in places]

    def merge(
        self, bodies: Mapping[int, Lines], places: Mapping[int, Place | None]
    ) -> tuple[list[tuple[list[int], Lines]], bool]:
        """Return bodies with all whose they are, and whether any reads ``copy``.

        ``bodies``: by what they are of; ``places``: where that stands.
        """
        alike: dict[object, list[int]] = {}
        unmerged: dict[Lines, list[int]] = {}
        for index, lines in bodies.items():
            unmerged.setdefault(lines, []).append(index)
        for index in bodies:
            place = places.get(index)
            key = ("", index) if place is None else (place.group, place.inner)
            alike.setdefault(key, []).append(index)
        found: dict[Lines, list[int]] = {}
        reads, saved = False, -TABLE - len(self._names.chart.states)
        for members in alike.values():
            place = places.get(members[0])
            whole = place is not None and len(members) == len(self._groups[place.group][0])
            together = self._unified([bodies[m] for m in members]) if whole else None
            if together is None:
                for member in members:
                    found.setdefault(bodies[member], []).append(member)
                continue
            if together != bodies[members[0]]:
                reads = True
                saved += (len(members) - 1) * len(bodies[members[0]]) * LINE - READ
                saved -= sum(map(_cost, together)) * LINE
            found.setdefault(together, []).extend(members)
        if reads and saved < 0:
            found, reads = unmerged, False
        return [(sorted(members), lines) for lines, members in found.items()], reads

    # --- bodies ---------------------------------------------------------------------------

    def _unified(self, bodies: Sequence[Lines]) -> Lines | None:
        """Return the lines that do for each copy what its own do; None if there are none."""
        bodies = _with_equal_locals(bodies)
        if len({len(lines) for lines in bodies}) != 1:
            return None
        found: list[str] = []
        apart = 0
        for lines in zip(*bodies, strict=True):
            line = self._line(lines)
            if line is not None:
                found.append(line)
            elif all(map(_STATEMENT.fullmatch, lines)):
                found += _switch(lines)
                apart += 1
            else:
                return None
        return None if 2 * apart > len(bodies[0]) else tuple(found)

    def _line(self, lines: Sequence[str]) -> str | None:
        if all(line == lines[0] for line in lines):
            return lines[0]
        words = [_WORD.findall(line) for line in lines]
        if len({len(each) for each in words}) != 1:
            return None
        found: list[str] = []
        for each in zip(*words, strict=True):
            word = each[0] if all(w == each[0] for w in each) else self._word(each)
            if word is None:
                return None
            found.append(word)
        text = "".join(found).replace(f"{MEMBER}.", "->")
        return _RAISED.sub(rf"\1({self._names.own}_event_name)", text)

    def _word(self, words: Sequence[str]) -> str | None:
        """Return what stands for the word of each copy."""
        same = self._same.get(words[0])
        if same is not None:
            return words[0] if all(self._same.get(word) == same for word in words) else None
        if all(re.fullmatch(_NUMBERED, word) for word in words):
            name = self._function(tuple(word.removesuffix("(m)") for word in words))
            return None if name is None else f"{name}(m, {COPY})"
        if all(word in self._structs for word in words):
            return self._struct_of(tuple(words))
        if all(word.startswith("m->fsm.") for word in words):
            regions = [f"m->{region}" for region in self._names.regions]
            if any(word not in regions for word in words):
                return None
            text = _linear([regions.index(word) for word in words])
            return None if text is None else f"*{self._names.own}_region_at(m, {text})"
        if all(word.startswith("[") for word in words):
            return _linear([int(word[1:-1]) for word in words], "[", "]")
        if all(word in self._numbers for word in words):
            return _linear([self._numbers[word] for word in words], first=words[0])
        if all(re.fullmatch(r"\d+u", word) for word in words):
            return _linear([int(word[:-1]) for word in words])
        return None

    def _struct_of(self, members: tuple[str, ...]) -> str | None:
        """Return the call that gives the address of what a copy has; all are of one type."""
        types = {self._structs[member] for member in members}
        if len(types) > 1:
            return None
        own = self._names.own
        if members not in self._merged:
            group = members[0].removeprefix("m->").split(".")[0]
            name = self._merged[members] = f"{own}_{group}_at_{len(self._merged)}"
            out = self._functions[0]
            out.define(name)
            out.line(f"static {types.pop()} *{name}({own} *m, uint8_t {COPY})")
            with out.block("{"):
                out.lines(_switch([f"return &{member};" for member in members]))
            out.line()
            out.define()
        return f"{self._merged[members]}(m, {COPY}){MEMBER}"

    # --- functions ------------------------------------------------------------------------

    def _function(self, names: tuple[str, ...]) -> str | None:
        """Return the function that does what those of all copies do, given which copy it is."""
        if names not in self._merged:
            self._merged[names] = self._defined(names)
        return self._merged[names]

    def _defined(self, names: tuple[str, ...]) -> str | None:
        for unit in self._functions:
            known = {each.name: each.lines for each in unit.definitions()}
            wanted = [known.get(name.removeprefix(f"{OWN}_"), ()) for name in names]
            if not all(wanted):
                continue
            bodies = [tuple(_below_head(lines)) for lines in wanted]
            body = self._unified(bodies)
            if body is None:
                return None
            (head,) = (line for line in wanted[0] if names[0] in line)
            name = f"{names[0]}_of"
            unit.define(name)
            unit.line(head.replace(f"{names[0]}({OWN} *m)", f"{name}({OWN} *m, uint8_t {COPY})"))
            unit.lines(body)
            unit.line()
            unit.define()
            return name
        return None


def _with_equal_locals(bodies: Sequence[Lines]) -> list[Lines]:
    """Return bodies whose local variables are called as those of the first, in their order."""
    names = [list(dict.fromkeys(_LOCAL.findall("\n".join(lines)))) for lines in bodies]
    if len({len(each) for each in names}) != 1:
        return list(bodies)
    found = []
    for lines, own in zip(bodies, names, strict=True):
        called = dict(zip(own, names[0], strict=True))
        found.append(tuple(_renamed(line, called) for line in lines))
    return found


def _renamed(line: str, called: Mapping[str, str]) -> str:
    return _LOCAL.sub(lambda match: called[match[0]], line)


def _cost(line: str) -> int:
    """Return how much a line takes that bodies of one copy do not have."""
    return line.count("_at_") + line.lstrip().startswith(("case ", "default:"))


def _below_head(lines: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a definition from its brace on."""
    begin = lines.index("{")
    yield from (line for line in lines[begin:] if line)


def _linear(
    values: Sequence[int], opening: str = "", closing: str = "", first: str = ""
) -> str | None:
    """Return the expression of the number of a copy that has these values."""
    step = values[1] - values[0]
    if step <= 0 or any(value != values[0] + n * step for n, value in enumerate(values)):
        return None
    text = COPY if step == 1 else f"{step}u * {COPY}"
    text = f"{first or f'{values[0]}u'} + {text}" if values[0] or first else text
    if opening:
        return f"{opening}{text}{closing}"
    most = values[-1]
    ctype = "uint8_t" if most <= NARROW else "uint16_t" if most < 1 << 16 else "uint32_t"
    return COPY if text == COPY else f"({ctype})({text})"


def _switch(lines: Sequence[str]) -> Iterator[str]:
    """Yield the statement of each copy, in a case of its own."""
    inset = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    yield f"{inset}switch ({COPY}) {{"
    for number, line in enumerate(lines):
        text = line.strip()
        yield f"{inset}    default:" if line is lines[-1] else f"{inset}    case {number}u:"
        yield f"{inset}        {text}"
        if not text.startswith("return "):
            yield f"{inset}        break;"
    yield f"{inset}}}"
