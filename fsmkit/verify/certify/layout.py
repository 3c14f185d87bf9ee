"""The layout of a machine's struct, from the debug information of a binary.

Two binaries of one machine hold the same members, but not always at the same places: pointers,
alignment and the order of bytes depend on the processor. A machine of one is translated into one of
the other member by member. Bytes that belong to no member do not count.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fsmkit.diagnostics import fail

if TYPE_CHECKING:
    from elftools.dwarf.die import DIE
    from elftools.dwarf.dwarfinfo import DWARFInfo

TRANSPARENT = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type")


@dataclass(frozen=True, slots=True)
class Part:
    """A scalar of a struct: its path, offset and size in bytes."""

    path: str
    offset: int
    size: int


@dataclass(frozen=True, slots=True)
class Union:
    """A payload, of which the number of the event beside it names the member in use."""

    machine: str
    """The prefix of the machine that the event belongs to."""
    event: Part
    offset: int
    size: int
    members: Mapping[str, tuple[Part, ...]]


@dataclass(frozen=True, slots=True)
class Layout:
    """The members of a machine."""

    size: int
    parts: tuple[Part, ...]
    unions: tuple[Union, ...]
    is_big_endian: bool = False

    def events(self, data: bytes) -> Iterator[tuple[Union, int]]:
        """Yield the payloads of a machine with the numbers of their events."""
        order: Literal["big", "little"] = "big" if self.is_big_endian else "little"
        for union in self.unions:
            at = union.event.offset
            number = int.from_bytes(data[at : at + union.event.size], order)
            yield union, number


Payloads = Mapping[str, Mapping[int, str]]
"""By the prefix of a machine and the number of an event: the member of the payload in use."""


class Translation:
    """Translates machines of one binary into machines of another one."""

    def __init__(self, source: Layout, target: Layout, payloads: Payloads) -> None:
        """Take both layouts, and the payloads that events use.

        Raises `FsmkitError` (``certify-layout``) if the members are not the same.
        """
        theirs = {part.path: part for part in target.parts}
        own = {part.path: part for part in source.parts}
        for path in sorted(own.keys() ^ theirs.keys()):
            which = "only this computer's binary" if path in own else "only the other binary"
            raise fail(
                "certify-layout",
                f"the struct of the machine differs: {which} has `{path}`",
                help="generate the code again with the same options, and rebuild the firmware",
            )
        for path, part in own.items():
            if part.size != theirs[path].size:
                raise fail(
                    "certify-layout",
                    f"the struct of the machine differs: `{path}` has {part.size} and "
                    f"{theirs[path].size} bytes",
                    help="generate the code again with the same options, and rebuild the firmware",
                )
        self.source, self.target = source, target
        self.is_same = source == target
        self._payloads = payloads
        self._swaps = source.is_big_endian != target.is_big_endian
        self._pairs = [(part, theirs[part.path]) for part in source.parts]
        unions = dict(zip((u.event.path for u in target.unions), target.unions, strict=True))
        self._unions = [(union, unions[union.event.path]) for union in source.unions]

    def translate(self, data: bytes) -> bytes:
        """Return a machine of the target; bytes of no member are zero."""
        found = bytearray(self.target.size)
        for part, to in self._pairs:
            self._copy(data, part, found, to)
        for (union, to_), (_, number) in zip(self._unions, self.source.events(data), strict=True):
            member = self._payloads[union.machine].get(number)
            if member is not None:
                pairs = zip(union.members[member], to_.members[member], strict=True)
                for part, to in pairs:
                    self._copy(data, part, found, to)
        return bytes(found)

    def _copy(self, data: bytes, part: Part, found: bytearray, to: Part) -> None:
        value = data[part.offset : part.offset + part.size]
        found[to.offset : to.offset + to.size] = value[::-1] if self._swaps else value


def layout_of(dwarf: DWARFInfo, name: str, *, is_big_endian: bool) -> Layout:
    """Return the layout of a struct. Raises `FsmkitError` if it is not described."""
    die = _find(dwarf, name)
    if die is None:
        raise fail(
            "certify-layout",
            f"the binary does not describe the struct `{name}`",
            help="compile with -g; it does not change the code",
        )
    parts: list[Part] = []
    unions: list[Union] = []
    _members(die, "", 0, parts, unions)
    size = die.attributes["DW_AT_byte_size"].value
    return Layout(size, tuple(parts), tuple(unions), is_big_endian)


def _find(dwarf: DWARFInfo, name: str) -> DIE | None:
    wanted = name.encode()
    for unit in dwarf.iter_CUs():
        for die in unit.get_top_DIE().iter_children():
            if die.tag != "DW_TAG_typedef":
                continue
            attribute = die.attributes.get("DW_AT_name")
            if attribute is not None and attribute.value == wanted:
                found = _bare(die)
                if found.tag == "DW_TAG_structure_type" and "DW_AT_byte_size" in found.attributes:
                    return found
    return None


def _bare(die: DIE) -> DIE:
    """Return a type without its names and qualifiers."""
    while die.tag in TRANSPARENT:
        die = die.get_DIE_from_attribute("DW_AT_type")
    return die


def _members(die: DIE, path: str, offset: int, parts: list[Part], unions: list[Union]) -> None:
    """Add the scalars of a type that lies at an offset."""
    name_ = _name(die) if "DW_AT_name" in die.attributes else ""
    die = _bare(die)
    match die.tag:
        case "DW_TAG_structure_type":
            payload, own = None, {}
            for member in die.iter_children():
                if member.tag != "DW_TAG_member":
                    continue
                name = _name(member)
                at = offset + _number(member, "DW_AT_data_member_location")
                of = member.get_DIE_from_attribute("DW_AT_type")
                if _bare(of).tag == "DW_TAG_union_type":
                    payload = (_bare(of), at)
                    continue
                if name == "spare_":
                    continue
                first = len(parts)
                _members(of, f"{path}.{name}", at, parts, unions)
                own[name] = parts[first] if len(parts) > first else None
            if payload is not None:
                event = own["event"]
                assert event is not None  # noqa: S101  (a payload is part of an event)
                unions.append(_union(name_.removesuffix("_event"), event, *payload))
        case "DW_TAG_array_type":
            element = die.get_DIE_from_attribute("DW_AT_type")
            counts = [_count(child) for child in die.iter_children()]
            total = 1
            for count in counts:
                total *= count
            size = _size(_bare(element))
            for place in range(total):
                _members(element, f"{path}[{place}]", offset + place * size, parts, unions)
        case _:
            parts.append(Part(path, offset, _size(die)))


def _union(machine: str, event: Part, die: DIE, offset: int) -> Union:
    members = {}
    for member in die.iter_children():
        if member.tag == "DW_TAG_member":
            found: list[Part] = []
            _members(member.get_DIE_from_attribute("DW_AT_type"), "", offset, found, [])
            members[_name(member)] = tuple(found)
    return Union(machine, event, offset, _size(die), members)


def _name(die: DIE) -> str:
    return str(die.attributes["DW_AT_name"].value.decode())


def _number(die: DIE, attribute: str) -> int:
    found = die.attributes.get(attribute)
    return 0 if found is None else int(found.value)


def _count(die: DIE) -> int:
    if "DW_AT_count" in die.attributes:
        return _number(die, "DW_AT_count")
    return _number(die, "DW_AT_upper_bound") + 1


def _size(die: DIE) -> int:
    if "DW_AT_byte_size" in die.attributes:
        return _number(die, "DW_AT_byte_size")
    assert die.tag == "DW_TAG_array_type"  # noqa: S101
    size = _size(_bare(die.get_DIE_from_attribute("DW_AT_type")))
    for child in die.iter_children():
        size *= _count(child)
    return size
