"""A network read back from its file: what `writing` writes, no more of UPPAAL's language."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from lxml import etree

from fsmkit.export.uppaal.network import (
    Declarations,
    Declared,
    Edge,
    Function,
    Label,
    Location,
    Network,
    Point,
    Query,
    Sort,
    Template,
)

DECLARATION = re.compile(
    r"(?P<const>const )?(?P<sort>int|bool|clock|(?:urgent )?broadcast chan)"
    r"(?:\[(?P<lo>-?\d+),(?P<hi>-?\d+)\])? (?P<name>\w+)(?:\[(?P<length>\d+)\])?"
    r"(?: = (?P<init>[^;]+))?;(?:  // (?P<comment>.*))?"
)
FUNCTION = re.compile(r"\w+ (\w+)\(.*\{")
SELECT = re.compile(r"(\w+) : int\[(-?\d+),(-?\d+)\]")
CONSTANTS = {"true": 1, "false": 0}


def read(text: str) -> Network:
    """Return the network of a file; `ValueError` where it is none of ours."""
    try:
        parser = etree.XMLParser(load_dtd=False, no_network=True, resolve_entities=False)
        root = etree.fromstring(text.encode(), parser)
    except etree.XMLSyntaxError as error:
        raise ValueError(f"this is no XML: {error}") from error
    lines = (root.findtext("declaration") or "").split("\n")
    remark = []
    while lines and lines[0].startswith("//"):
        remark.append(lines.pop(0)[3:])
    system = root.findtext("system") or ""
    instances = {t: i for i, t in re.findall(r"(\w+) = (\w+)\(\);", system)}
    return Network(
        tuple(remark),
        _declarations(lines),
        tuple(_template(one, instances) for one in root.iterfind("template")),
        tuple(
            Query(one.findtext("formula") or "", one.findtext("comment") or "")
            for one in root.iterfind("queries/query")
        ),
    )


def _declarations(lines: list[str]) -> Declarations:
    found: list[Declared | Function] = []
    waiting = [line for line in lines if line]
    while waiting:
        match = DECLARATION.fullmatch(waiting[0])
        if match is not None:
            waiting.pop(0)
            found.append(_declared(match))
            continue
        function = FUNCTION.match(waiting[0])
        if function is None or "}" not in waiting:
            raise ValueError(f"`{waiting[0]}` is no declaration that is written here")
        end = waiting.index("}") + 1
        found.append(Function(function[1], "\n".join(waiting[:end])))
        waiting = waiting[end:]
    return tuple(found)


def _declared(match: re.Match[str]) -> Declared:
    values = re.findall(r"true|false|-?\d+", match["init"] or "")
    return Declared(
        match["name"],
        Sort(match["sort"]),
        int(match["lo"] or 0),
        int(match["hi"] or 0),
        int(match["length"] or 0),
        tuple(CONSTANTS[v] if v in CONSTANTS else int(v) for v in values),
        constant=match["const"] is not None,
        comment=match["comment"] or "",
    )


def _template(one: etree._Element, instances: dict[str, str]) -> Template:
    name = one.findtext("name") or ""
    initial = one.find("init")
    if name not in instances or initial is None:
        raise ValueError(f"the template `{name}` has no instance or no initial location")
    return Template(
        name,
        instances[name],
        _declarations((one.findtext("declaration") or "").split("\n")),
        tuple(_location(part) for part in one.iterfind("location")),
        initial.get("ref", ""),
        tuple(_edge(part) for part in one.iterfind("transition")),
    )


def _location(one: etree._Element) -> Location:
    invariant, at = _label(one, "invariant")
    return Location(
        one.get("id", ""),
        one.findtext("name") or "",
        tuple(conjuncts(invariant)),
        committed=one.find("committed") is not None,
        urgent=one.find("urgent") is not None,
        color=one.get("color", ""),
        at=_place(one),
        name_at=_place(one.find("name")),
        invariant_at=at,
    )


def _edge(one: etree._Element) -> Edge:
    source, target = one.find("source"), one.find("target")
    if source is None or target is None:
        raise ValueError("a transition has no source or no target")
    found = {kind: _label(one, kind.value) for kind in Label}
    select, guard, sync, update, comment = (
        found[kind][0]
        for kind in (Label.SELECT, Label.GUARD, Label.SYNC, Label.UPDATE, Label.COMMENT)
    )
    return Edge(
        source.get("ref", ""),
        target.get("ref", ""),
        tuple((name, int(lo), int(hi)) for name, lo, hi in SELECT.findall(select)),
        tuple(conjuncts(guard)),
        sync,
        tuple(split(update, ",")),
        comment,
        one.get("color", ""),
        tuple((kind, at) for kind, (_, at) in found.items() if at is not None),
        tuple(place for nail in one.iterfind("nail") if (place := _place(nail)) is not None),
    )


def _label(one: etree._Element, kind: str) -> tuple[str, Point | None]:
    found = one.find(f"label[@kind='{kind}']")
    return ("", None) if found is None else ((found.text or "").replace("\n", " "), _place(found))


def _place(one: etree._Element | None) -> Point | None:
    if one is None or one.get("x") is None:
        return None
    return int(one.get("x", "0")), int(one.get("y", "0"))


def conjuncts(text: str) -> list[str]:
    """Return the parts of a conjunction."""
    return split(text, "&&")


def innermost(parts: Iterable[str]) -> Iterator[str]:
    """Yield the parts of conjunctions, those in parentheses, too."""
    for part in parts:
        inner = part[1:-1]
        is_whole = part.startswith("(") and part.endswith(")")
        nested = conjuncts(inner)
        if is_whole and len(nested) > 1 and not any(len(split(inner, s)) > 1 for s in ("||", "?")):
            yield from innermost(nested)
        else:
            yield part


def split(text: str, separator: str) -> list[str]:
    """Split at a separator that stands outside all brackets."""
    found, depth, start, at = [], 0, 0, 0
    while at < len(text):
        if text[at] in "([{":
            depth += 1
        elif text[at] in ")]}":
            depth -= 1
        elif depth == 0 and text.startswith(separator, at):
            found.append(text[start:at].strip())
            at += len(separator)
            start = at
            continue
        at += 1
    rest = text[start:].strip()
    return [*found, rest] if rest else found
