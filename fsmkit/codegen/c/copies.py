"""The variables of copies of a used chart, as members of a struct: ``m->data.left.tries``.

Copies of one chart share the type of the struct. A function of the host can therefore take a
pointer to the data of any copy. An array of copies is an array of structs. Copies whose constants
lead to other member types have a struct type of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart, Data
from fsmkit.codegen.c.reserved import KEYWORDS, unreserved
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Namer, snake
from fsmkit.language import Type

Shape = tuple[object, ...]
"""The structural key of a struct: equal keys share one type."""


Step = tuple[str, int | None]
"""A member, and its index within an array."""
MemberPath = tuple[Step, ...]
"""The path from the machine's struct to a variable: the group, then member by member."""


def member_path(path: MemberPath) -> str:
    """Return a path in C syntax, relative to the machine."""
    return ".".join(name if index is None else f"{name}[{index}]" for name, index in path)


@dataclass(slots=True)
class Part:
    """A member of a struct: a variable, a struct, or several of one type."""

    name: str
    variable: Data | None = None
    struct: Struct | None = None
    count: int = 0
    """The number of elements of an array of structs, 0 for a single one."""


@dataclass(slots=True)
class Struct:
    """A struct type."""

    name: str
    parts: tuple[Part, ...]


@dataclass
class _Node:
    """The content of a copy: its variables by their names there, and the copies in it."""

    chart: str = ""
    variables: dict[str, Data] = field(default_factory=dict)
    inner: dict[str, _Node] = field(default_factory=dict)

    @property
    def is_array(self) -> bool:
        """Whether the node represents an array of copies, which it holds by their index."""
        return bool(self.inner) and all(name.isdecimal() for name in self.inner)


@dataclass
class Structs:
    """The structs of one machine, in the order of declaration."""

    prefix: str
    records: Mapping[str, str]
    types: Namer
    found: dict[Shape, Struct] = field(default_factory=dict)
    members: dict[str, list[Part]] = field(default_factory=dict)
    """By group: the members that hold copies."""
    paths: dict[str, MemberPath] = field(default_factory=dict)
    """By variable: its path."""
    copied: frozenset[str] = frozenset()

    @property
    def all(self) -> tuple[Struct, ...]:
        """All structs, each before those that contain it."""
        return tuple(self.found.values())

    def add(self, group: str, chart: Chart, variables: Iterable[Data]) -> None:
        """Assign the variables of copies in a group of the machine to structs."""
        root = _tree(chart, {data.name: data for data in variables})
        suffix = "" if group == "data" else f"_{group}"
        members = [
            part
            for name, node in root.inner.items()
            for part in self._parts(name, node, ((group, None),), suffix)
        ]
        if members:
            self.members[group] = members

    def struct_at(self, path: MemberPath) -> str | None:
        """Return the C type of the struct of copies at the end of a path, or None."""
        (group, _), *steps = path
        parts: Iterable[Part] = self.members.get(group, ())
        struct: Struct | None = None
        for name, _ in steps:
            found = next((part for part in parts if part.name == name), None)
            struct = None if found is None else found.struct
            parts = () if struct is None else struct.parts
        return None if struct is None else struct.name

    def _parts(self, name: str, node: _Node, path: MemberPath, suffix: str) -> Iterator[Part]:
        """Yield the member for a copy; copies that cannot form an array yield one member each."""
        member = unreserved(name)
        if not node.is_array:
            yield Part(member, struct=self._struct(node, (*path, (member, None)), name, suffix))
            return
        elements = [
            self._struct(each, (*path, (member, index)), f"{name}_{index}", suffix)
            for index, each in enumerate(node.inner.values())
        ]
        is_counted = [*node.inner] == [str(index) for index in range(len(elements))]
        if is_counted and all(each is elements[0] for each in elements):
            yield Part(member, struct=elements[0], count=len(elements))
            return
        for index, each in node.inner.items():
            own = f"{member}_{index}"
            struct = self._struct(each, (*path, (own, None)), own, suffix)
            yield Part(own, struct=struct)

    def _struct(self, node: _Node, path: MemberPath, name: str, suffix: str) -> Struct:
        members = Namer(KEYWORDS)
        parts: list[Part] = []
        for inner, data in node.variables.items():
            member = members.name(unreserved(inner), "_value")
            self.paths[data.name] = (*path, (member, None))
            parts.append(Part(member, variable=data))
        for inner, each in node.inner.items():
            parts += self._parts(inner, each, path, suffix)
        shape: Shape = (node.chart, suffix, *(self._shape(part) for part in parts))
        if shape not in self.found:
            is_first = all(known[:2] != shape[:2] for known in self.found)
            called = snake(node.chart) if is_first else snake(name)
            text = f"{self.prefix}_{self.types.name(f'{called}{suffix}', '_data')}"
            self.found[shape] = Struct(text, tuple(parts))
        return self.found[shape]

    def _shape(self, part: Part) -> Shape:
        if part.variable is not None:
            type_: Type = part.variable.type
            return part.name, storage(type_, dict(self.records)), str(type_)
        assert part.struct is not None  # noqa: S101  (a part is one of the two)
        return part.name, part.struct.name, part.count


def _tree(chart: Chart, variables: Mapping[str, Data]) -> _Node:
    root = _Node()
    for copy in chart.copies:
        own = {inner: variables[name] for name, inner in copy.variables if name in variables}
        if not own:
            continue
        node = root
        for token in copy.name.split("."):
            node = node.inner.setdefault(token, _Node())
        node.chart, node.variables = copy.chart, own
    return root


def structs_of(chart: Chart, prefix: str, records: Mapping[str, str], types: Namer) -> Structs:
    """Return the structs of a machine; ``types``: the names of types and functions."""
    found = Structs(prefix, records, types)
    for group, of in (("in", chart.inputs), ("out", chart.outputs), ("data", chart.data)):
        found.add(group, chart, of)
    found.copied = frozenset(found.paths)
    return found
