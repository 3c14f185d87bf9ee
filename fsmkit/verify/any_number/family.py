"""Read a system for every value of a parameter, and reject systems that are not uniform.

A system is *uniform* if the machines of its arrays differ only by their distance from the first and
the last one. This module decides that from the source alone, for all values of the parameter:

* The index ranges of arrays are ``c..N + d``. All arrays over the parameter have the same range.
* Indices, constants under ``with`` and constants of charts are sums, remainders by the number of
  machines, ``min``, ``max`` and comparisons (`terms`). They have one form for all machines but a
  few at each end.
* A constant that is not the same for all machines is only used as an index of shared arrays. It has
  no influence on a step but for the element that it names.
* Arrays that grow with the parameter are shared, and only accessed by such indices.
* Nothing else names the parameter: no delay, capacity, schedule or start value.

Then local steps do not depend on the number of machines, and the neighbourhoods of one system occur
in all larger ones.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path

from fsmkit.chart.loading import named_file, read_bytes, read_documents
from fsmkit.diagnostics import Findings, FsmkitError, Span, Text, fail
from fsmkit.document.document import DocData, Document
from fsmkit.language.statements.tree import Assign
from fsmkit.system.any_file import load_any
from fsmkit.system.indices import DECLARED
from fsmkit.system.parameters import NAME, with_parameters
from fsmkit.system.system import System
from fsmkit.verify.any_number.terms import Ends, Known, NotUniformError, Term, term_of
from fsmkit.yaml import nodes
from fsmkit.yaml.encoding import decode

ANY = re.compile(r"\s*(?:(?P<least>\d+)\s*\.\.\s*)?any\s*")
"""``any``, or ``3..any``."""
MOST_LEAST = 1_000
"""The greatest first value of the parameter."""
LEAST = 2
"""The least value of the parameter unless the user gives one."""
MOST_ENDS = 3
"""Machines at each end that may differ from those in the middle."""
RULE = "not-uniform"
USES = "use it only as an index of a shared array, as in `taken[N]`"
ID_TYPE = re.compile(r"\s*0\s*\.\.\s*([^=]+?)\s*(?:=\s*(\w+)\s*)?")
COMPARED = re.compile(
    r"(?:(?<=\()|^|(?<=\band )|(?<=\bor )|(?<=\bnot ))\s*([A-Za-z_]\w*)\s*[=!]=\s*(\w+)\s*"
    r"(?=\)|$|\band\b|\bor\b)"
)
"""A comparison of a shared variable with a number, as a whole operand of a condition."""
INDEXED = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\s*\[")
PLAIN_INDEX = re.compile(r"\[\s*([A-Za-z_]\w*)\s*\]")


def any_parameter(parameters: Mapping[str, str]) -> str | None:
    """Return the parameter with the value ``any``; None without one."""
    found = [name for name, value in parameters.items() if ANY.fullmatch(value)]
    if len(found) > 1:
        raise fail(
            RULE,
            f"{' and '.join(f'`{name}`' for name in found)} cannot both be `any`",
            help="give a number to all parameters but one",
        )
    return found[0] if found else None


@dataclass(frozen=True, slots=True)
class Family:
    """A uniform system for every value of its parameter from ``least`` on.

    ``arrays``: the arrays over the parameter; their indices run from ``low`` to the parameter plus
    ``high``. ``ends``: the machines that differ from those in the middle. ``entries``: the
    properties of the file with the parameter as a name.
    """

    path: Path
    parameter: str
    least: int
    given: Mapping[str, str]
    strict: bool
    arrays: tuple[str, ...]
    low: int
    high: int
    ends: Ends
    entries: tuple[tuple[Text, nodes.Node], ...]
    ids: tuple[str, ...] = ()
    """Shared variables that hold the number of a machine, or a smaller number for none."""
    is_symmetric: bool = False
    """Machines may change places: their own number is only stored in and compared with `ids`."""

    def system(self, value: int, findings: Findings) -> System:
        """Return the system for a value of the parameter. Raises `FsmkitError`."""
        given = {**self.given, self.parameter: str(value)}
        return load_any(self.path, findings, strict=self.strict, parameters=given)

    def length(self, value: int) -> int:
        """Return the number of machines of an array for a value of the parameter."""
        return value + self.high - self.low + 1

    def value(self, length: int) -> int:
        """Return the value of the parameter for a number of machines."""
        return length - self.high + self.low - 1

    def places(self) -> Iterator[Term]:
        """Yield the representative positions: those at the ends, and one in the middle."""
        yield from (Term(constant=n) for n in range(self.ends.low))
        yield Term(position=1)
        yield from (Term(length=1, constant=-1 - n) for n in range(self.ends.high))

    def names_at(self, place: Term) -> dict[str, Known]:
        """Return the parameter, with its value at a place."""
        del place
        return {self.parameter: Term(length=1, constant=self.low - self.high - 1)}


def read_family(
    path: Path, parameters: Mapping[str, str], findings: Findings, *, strict: bool = False
) -> Family:
    """Return the family of a system file; one value of ``parameters`` is ``any``.

    Raises `FsmkitError` with the reason if the system is not uniform.
    """
    parameter = any_parameter(parameters)
    assert parameter is not None  # noqa: S101  (the caller's condition)
    match = ANY.fullmatch(parameters[parameter])
    least = LEAST if match is None or match["least"] is None else int(match["least"])
    if least > MOST_LEAST:
        raise fail(
            RULE,
            f"`{parameters[parameter]}` starts from a value above {MOST_LEAST:,}",
            help="write `any`: a proof from 2 on includes all greater values",
        )
    given = {name: value for name, value in parameters.items() if name != parameter}
    source = decode(read_bytes(path), str(path), findings)
    findings.stop_on_errors()
    root = None if source is None else nodes.read_nodes(source, findings)
    findings.stop_on_errors()
    if not isinstance(root, nodes.Mapping) or not any(k.value == "system" for k, _ in root.entries):
        raise fail(
            RULE,
            f"`{path}` is not a system: `{parameter}` cannot be `any`",
            help="name a system file with an array of machines",
        )
    _require_last(root, parameter)
    root, _ = with_parameters(root, {**given, parameter: parameter}, findings)
    findings.stop_on_errors()
    return _Reader(path, root, parameter, findings).family(least, given, strict=strict)


def _require_last(root: nodes.Mapping, parameter: str) -> None:
    """Reject other parameters that depend on the parameter."""
    declared = {key.value: value for key, value in root.entries}.get("parameters")
    entries = declared.entries if isinstance(declared, nodes.Mapping) else ()
    for name, value in entries:
        if name.value != parameter and isinstance(value, nodes.Scalar):
            _require_free(value.text, (parameter,), f"the parameter `{name}` depends on it")


def _require_free(text: Text, names: Sequence[str], why: str) -> None:
    """Reject a text that contains one of some names."""
    for name in names:
        if re.search(rf"(?<![\w.]){re.escape(name)}(?!\w)", text.value):
            raise fail(RULE, f"`{name}` cannot be `any`: {why}", text, help="write a number there")


class _Reader:
    """Reads the parts of a system file in which the parameter may occur."""

    def __init__(self, path: Path, root: nodes.Mapping, parameter: str, findings: Findings) -> None:
        self.path, self.parameter, self.findings = path, parameter, findings
        self.parts = {key.value: value for key, value in root.entries}
        self.ends = Ends()
        self.arrays: dict[str, tuple[str, Mapping[str, nodes.Node]]] = {}
        self.fixed: list[str] = []
        self.low = self.high = 0
        self.in_middle = False
        self.sized: dict[str, Text] = {}
        self.ids: dict[str, Text] = {}

    def family(self, least: int, given: Mapping[str, str], *, strict: bool) -> Family:
        """Return the family. Raises `FsmkitError`."""
        self._machines()
        for key in ("schedule",):
            if key in self.parts:
                raise fail(
                    RULE,
                    "a cyclic schedule has a fixed number of machines",
                    self.parts[key].span,
                    help=f"remove `{key}`, or give `{self.parameter}` a number",
                )
        self._shared()
        family = self._family(least, given, strict=strict)
        while True:
            before = (self.ends.low, self.ends.high, self.ends.length)
            for place in family.places():
                self._check(family, place)
            if max(self.ends.low, self.ends.high) > MOST_ENDS:
                raise fail(
                    RULE,
                    f"more than {MOST_ENDS} machines at an end of `{next(iter(self.arrays))}` "
                    "differ from those in the middle",
                    self.parts["machines"].span,
                    help="compare the index with the first or the last one only",
                )
            if before == (self.ends.low, self.ends.high, self.ends.length):
                break
        has_ends = self.ends.low + self.ends.high > 0
        self.ends.high = max(1, self.ends.high)  # where a ring of windows starts
        return replace(family, is_symmetric=self._is_symmetric() and not has_ends)

    def _family(self, least: int, given: Mapping[str, str], *, strict: bool) -> Family:
        entries = nodes.entries_of(self.parts.get("properties"), "`properties`", self.findings)
        arrays = tuple(self.arrays)
        return Family(
            self.path, self.parameter, least, given, strict, arrays, self.low, self.high,
            self.ends, entries, tuple(self.ids),
        )  # fmt: skip

    def _is_symmetric(self) -> bool:
        """Return whether nothing but the number of a machine differs between machines."""
        if "connect" in self.parts or self.sized or self.fixed:
            return False
        indices = [
            index
            for text in _scalars(self.parts.get("environment"))
            for index in re.findall(r"\[([^\[\]]*)\]", text.value)
        ]
        if any(not index.strip().isidentifier() for index in indices):
            return False
        return all(
            text.value.strip() in (variable, self.parameter)
            or not {variable, self.parameter}.intersection(NAME.findall(text.value))
            for variable, parts in self.arrays.values()
            for text in _scalars(parts.get("with"))
        )

    # --- declarations ----------------------------------------------------------------------------

    def _machines(self) -> None:
        for name, node in nodes.entries_of(self.parts.get("machines"), "`machines`", self.findings):
            match = DECLARED.fullmatch(name.value)
            parts = node.entries if isinstance(node, nodes.Mapping) else ()
            if match is None or self.parameter not in NAME.findall(match[4] + " " + match[3]):
                _require_free(name, (self.parameter,), "this is no range of an array")
                for _, value in parts:
                    for text in _scalars(value):
                        _require_free(text, (self.parameter,), "a single machine depends on it")
                self.fixed.append(name.value if match is None else match[1])
                continue
            names = {self.parameter: Term(length=1)}
            try:
                low = term_of(name.part(*match.span(3)), names, self.ends)
                high = term_of(name.part(*match.span(4)), names, self.ends)
            except NotUniformError as error:
                raise self._rejection(name, str(error)) from error
            is_known = isinstance(low, Term) and low.is_constant and isinstance(high, Term)
            if not is_known or not isinstance(high, Term) or (high.position, high.length) != (0, 1):
                raise self._rejection(name, f"write a range such as `0..{self.parameter} - 1`")
            assert isinstance(low, Term)  # noqa: S101  (tested above)
            found = (low.constant, high.constant)
            if self.arrays and found != (self.low, self.high):
                raise self._rejection(name, "all arrays over it must have the same range")
            self.low, self.high = found
            self.arrays[match[1]] = (match[2], {key.value: value for key, value in parts})
        if not self.arrays:
            raise fail(
                RULE,
                f"no array of machines has a range up to `{self.parameter}`",
                help=f'write `"node[i in 0..{self.parameter} - 1]"` under `machines`',
            )

    def _shared(self) -> None:
        for name, value in nodes.entries_of(self.parts.get("shared"), "`shared`", self.findings):
            for text in _scalars(value):
                if self.parameter not in NAME.findall(text.value):
                    continue
                (self.sized if "[" in text.value else self.ids)[name.value] = text

    def _rejection(self, at: Text | Span, why: str) -> FsmkitError:
        return fail(
            RULE,
            f"`{self.parameter}` cannot be `any` here: {why}",
            at,
            help="docs/how-to/any-number.md describes the systems that have a proof for all sizes",
        )

    # --- uses at one place -----------------------------------------------------------------------

    def _check(self, family: Family, place: Term) -> None:
        """Evaluate all expressions over the index and the parameter for one machine."""
        names = family.names_at(place)
        index = place.plus(Term(constant=self.low))
        self.in_middle = place.position == 1
        try:
            for name, text in self.sized.items():
                self._brackets(text, names, f"the type of `{name}`")
            for name, text in self.ids.items():
                self._id(name, text, names)
            for array, (variable, parts) in self.arrays.items():
                self._array(array, {**names, variable: index}, parts)
            for item in nodes.items_of(self.parts.get("connect"), "`connect`", self.findings):
                self._connection(item, names, index)
            for text in _scalars(self.parts.get("environment")):
                self._ends(text, names, index)
        except NotUniformError as error:
            raise self._rejection(error.span, str(error)) from error

    def _connection(self, item: nodes.Node, names: Mapping[str, Known], index: Term) -> None:
        if isinstance(item, nodes.Mapping):
            for text, options in item.entries:
                self._ends(text, names, index)
                for option in _scalars(options):
                    _require_free(option, (self.parameter,), "a connection depends on it")
        elif isinstance(item, nodes.Scalar):
            self._ends(item.text, names, index)

    def _ends(self, text: Text, names: Mapping[str, Known], index: Term) -> None:
        """Evaluate the indices in a connection or under `environment`."""
        free = PLAIN_INDEX.findall(text.value)
        variables = {**names, **{name: index for name in free if name != self.parameter}}
        rest = text.value
        for match in reversed(list(re.finditer(r"\[([^\[\]]*)\]", text.value))):
            value = term_of(text.part(*match.span(1)), variables, self.ends)
            self._touch(value, text)
            rest = rest[: match.start()] + rest[match.end() :]
        if self.parameter in NAME.findall(rest):
            raise NotUniformError("it is not part of an index", text.span)

    def _touch(self, value: Known, text: Text) -> None:
        """Require an index near the machine, and note one near an end that others name."""
        if not isinstance(value, Term):
            raise NotUniformError("an index is not a number", text.span)
        if value.position not in (0, 1) or value.length not in (0, 1):
            raise NotUniformError("an index grows faster than the number of machines", text.span)
        if value.position and value.length:
            raise NotUniformError("an index leaves its range", text.span)
        if not self.in_middle:
            return
        if not value.position and not value.length:
            self.ends.low = max(self.ends.low, value.constant - self.low + 1)
        elif not value.position:
            self.ends.high = max(self.ends.high, self.low - value.constant)

    def _brackets(self, text: Text, names: Mapping[str, Known], what: str) -> None:
        """Evaluate the length in the type of a shared array, the only place of the parameter."""
        rest = text.value
        positional = {name for name, value in names.items() if not _is_fixed(value)}
        for match in reversed(list(re.finditer(r"\[([^\[\]]*)\]", text.value))):
            value = term_of(text.part(*match.span(1)), names, self.ends)
            if not isinstance(value, Term) or (value.position, value.length) not in (
                (0, 1), (0, 0),
            ):  # fmt: skip
                raise NotUniformError(f"{what} has another length", text.span)
            rest = rest[: match.start()] + rest[match.end() :]
        if positional.intersection(NAME.findall(rest)):
            raise NotUniformError(f"{what} depends on it beside its length", text.span)

    def _id(self, name: str, text: Text, names: Mapping[str, Known]) -> None:
        """Require that a type of numbers of machines holds each of them, and starts with none."""
        match = ID_TYPE.fullmatch(text.value)
        if match is None or self.low < 1:
            raise NotUniformError(
                f"`{name}` is not of the form `0..{self.parameter} = 0`, with machines from 1 on",
                text.span,
            )
        high = term_of(text.part(*match.span(1)), names, self.ends)
        last = Term(length=1, constant=self.low - 1)
        if not isinstance(high, Term) or high.plus(last, -1) not in map(_constant, range(9)):
            raise NotUniformError(f"`{name}` does not hold the number of each machine", text.span)
        if match[2] is not None:
            self._require_none(text.part(*match.span(2)))

    def _require_none(self, text: Text) -> None:
        """Require a number that is that of no machine."""
        if not text.value.strip().isdecimal() or int(text.value) >= self.low:
            raise NotUniformError("it is the number of a machine", text.span)

    def _is_left_out(self, constants: _Constants) -> Callable[[object], bool]:
        """Return whether a part of a document needs no further check: a store of a number."""

        def is_left_out(node: object) -> bool:
            if isinstance(node, DocData):
                return node.name.value in self.sized or node.name.value in self.ids
            if not isinstance(node, Assign) or not isinstance(node.location, Text):
                return False
            if node.location.value.strip() not in self.ids or node.operator:
                return False
            value = node.value
            return isinstance(value, Text) and self._is_number(value.value, constants)

        return is_left_out

    def _is_number(self, text: str, constants: _Constants) -> bool:
        """Return whether a text is the own number of a machine, or a number of no machine."""
        text = text.strip()
        if text.isdecimal():
            return int(text) < self.low
        return constants.own_number(text)

    def _array(
        self, array: str, names: Mapping[str, Known], parts: Mapping[str, nodes.Node]
    ) -> None:
        variable = self.arrays[array][0]
        for text in _scalars(parts.get("start")):
            _require_free(text, (self.parameter, variable), "a start value depends on it")
        given: dict[str, tuple[Text, Mapping[str, Known]]] = {}
        for name, value in nodes.entries_of(parts.get("with"), "`with`", self.findings):
            for text in _scalars(value):
                given[name.value] = (text, names)
        chart = parts.get("chart")
        if not isinstance(chart, nodes.Scalar):
            return
        own = Findings()
        file = named_file(self.path.parent / "system", chart.text.value)
        documents = read_documents(file, own)
        own.stop_on_errors()
        constants = _Constants(documents, given, self.ends)
        constants.index = names[variable]
        sized = set(self.sized)
        for document in documents:
            for data in document.data:
                if data.name.value in sized and data.type is not None:
                    self._brackets(data.type, constants.values, f"the type of `{data.name}`")
                if data.name.value in sized and data.init is not None:
                    self._text_of_chart(data.init, constants, sized)
                if data.name.value in self.ids and data.type is not None:
                    self._id(data.name.value, data.type, constants.values)
                    if data.init is not None:
                        self._require_none(data.init)
            for text in _texts(document, self._is_left_out(constants)):
                self._text_of_chart(text, constants, sized)

    def _text_of_chart(self, text: Text, constants: _Constants, sized: set[str]) -> None:
        """Require that values that depend on the position are only indices of shared arrays."""
        covered: list[tuple[int, int]] = []
        for match in INDEXED.finditer(text.value):
            end = closing_bracket(text.value, match.end(), "[", "]")
            inner = text.part(match.end(), end)
            if match[1] in sized:
                covered.append((match.start(), end))
                self._touch(term_of(inner, constants.values, self.ends), text)
        covered += [
            match.span()
            for match in COMPARED.finditer(text.value)
            if match[1] in self.ids and self._is_number(match[2], constants)
        ]
        for match in NAME.finditer(text.value):
            is_inside = any(start <= match.start() < end for start, end in covered)
            after_dot = text.value[: match.start()].endswith(".")
            if is_inside or after_dot:
                continue
            if match[0] in constants.positional or match[0] in sized or match[0] in self.ids:
                what = (
                    "differs by position"
                    if match[0] in constants.positional
                    else ("grows with the system")
                )
                raise fail(
                    RULE,
                    f"`{match[0]}` {what}, and is used beside an index",
                    text.part(*match.span()),
                    help=USES,
                )


class _Constants:
    """The constants of a chart at one position.

    ``values``: those that are known; ``positional``: those that depend on the position.
    """

    def __init__(
        self,
        documents: tuple[Document, ...],
        given: Mapping[str, tuple[Text, Mapping[str, Known]]],
        ends: Ends,
    ) -> None:
        self.index: Known = False
        self.values: dict[str, Known] = {}
        self.positional: set[str] = set()
        for document in reversed(documents):
            for constant in document.constants:
                name = constant.name.value
                text, names = given.get(name, (constant.value, self.values))
                try:
                    value = term_of(text, names, ends)
                except NotUniformError:
                    used = set(NAME.findall(text.value))
                    unknown = {n for n, v in names.items() if not _is_fixed(v)}
                    if used & (unknown | self.positional):
                        raise
                    continue
                self.values[name] = value
                self.positional.discard(name)
                if not _is_fixed(value):
                    self.positional.add(name)

    def own_number(self, name: str) -> bool:
        """Return whether a constant is the number of the machine."""
        value = self.values.get(name)
        return name in self.positional and value == self.index


def _constant(value: int) -> Term:
    return Term(constant=value)


def _is_fixed(value: Known) -> bool:
    return not isinstance(value, Term) or value.is_constant


def closing_bracket(text: str, start: int, opening: str, closing: str) -> int:
    """Return the position of the bracket that closes the one before ``start``."""
    depth = 0
    for place in range(start, len(text)):
        if text[place] == closing:
            if depth == 0:
                return place
            depth -= 1
        depth += text[place] == opening
    return len(text)


def _scalars(node: nodes.Node | None) -> Iterator[Text]:
    """Yield the values in a node, and the keys of its mappings."""
    match node:
        case nodes.Scalar(text):
            yield text
        case nodes.Sequence(items):
            for item in items:
                yield from _scalars(item)
        case nodes.Mapping(entries):
            for key, value in entries:
                yield key
                yield from _scalars(value)
        case None:
            pass


def _texts(node: object, is_left_out: Callable[[object], bool]) -> Iterator[Text]:
    """Yield the unread texts of a document, without its constants."""
    if isinstance(node, Text):
        yield node
    elif isinstance(node, tuple):
        for item in node:
            yield from _texts(item, is_left_out)
    elif is_left_out(node):
        return
    elif is_dataclass(node) and not isinstance(node, Span):
        for one in fields(node):
            if isinstance(node, Document) and one.name in ("constants", "source", "name"):
                continue
            yield from _texts(getattr(node, one.name), is_left_out)
