"""What a class can do without: the trace, and methods that nothing calls."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

TRACED_ONLY = ("_cause", "trace")
"""Variables that nothing but the trace needs."""
RESET = re.compile(rf"self\.(?:{'|'.join(TRACED_ONLY)})(?:: .*)? = None")
DECLARED = re.compile(rf'"?(?:{"|".join(TRACED_ONLY)})"?(?:,|: .*)')
OPENING = re.compile(r"(?:@|def |_?[A-Z]\w*: ClassVar|dispatch_\w+ = )")
OFFERED = ("NAME", "STATES", "EVENTS")
"""Constants that a host may use."""
ASSIGNED = re.compile(r" +((?:self\._[a-z]\w* [-+|&^]?= )+)")
CALL = re.compile(r"\w\(")
TARGET = re.compile(r"self\.(_[a-z]\w*)")
SECTION = re.compile(r"# --- .* -+")


def without_trace(text: str) -> str:
    """Return the text of a class without the variables that nothing but its trace needs."""
    kept = [
        line
        for line in text.splitlines()
        if not RESET.fullmatch(line.strip()) and not DECLARED.fullmatch(line.strip())
    ]
    return "\n".join(kept) + "\n"


def without_suites(text: str, openings: re.Pattern[str]) -> str:
    """Return the text of a class without the suites that some lines open."""
    kept: list[str] = []
    outside: int | None = None
    """How deep the suite is indented that is being left out."""
    for line in text.splitlines():
        stripped = line.lstrip()
        depth = len(line) - len(stripped)
        if outside is not None and (depth > outside or not stripped):
            continue
        if outside is not None:
            _close(kept, outside)
            outside = None
        if openings.fullmatch(stripped):
            outside = depth
        else:
            kept.append(line)
    if outside is not None:
        _close(kept, outside)
    return "\n".join(kept) + "\n"


def _close(kept: list[str], depth: int) -> None:
    """Give a suite that holds nothing any more its ``pass``."""
    last = kept[-1].strip()
    if last.endswith(":") and not last.startswith(("#", '"')):
        kept.append(" " * depth + "pass")


@dataclass
class Unit:
    """A method or a table of a class: its lines, the empty ones before it among them."""

    lines: list[str]
    name: str


def trimmed(text: str) -> str:
    """Return the text of a class without private methods, tables and slots that nothing mentions.

    What counts is what the public ones mention, directly or not.
    """
    units = _units(text)
    head = units[0]
    wanted = {unit.name for unit in units if _is_offered(unit.name)}
    todo = [unit for unit in units if unit.name in wanted]
    by_name = {unit.name: unit for unit in units}
    while todo:
        for word in set(re.findall(r"\b(?:_\w+|[A-Z_]+\b)", "\n".join(todo.pop().lines))):
            if word in by_name and word not in wanted:
                wanted.add(word)
                todo.append(by_name[word])
    kept = [unit for unit in units[1:] if unit.name in wanted]
    _forget(kept)
    used = set(re.findall(r"\._\w+", "\n".join(line for unit in kept for line in unit.lines)))
    lines = [line for unit in kept for line in unit.lines]
    return "\n".join(_without_sections([*_declared(head, used), *lines]))


def _forget(units: list[Unit]) -> None:
    """Leave out the assignments to private variables that nothing reads."""
    body = "\n".join(line for unit in units for line in unit.lines)
    lines = [*filter(ASSIGNED.match, body.splitlines())]
    targets = Counter(name for line in lines for name in TARGET.findall(_targets(line)))
    every = Counter(re.findall(r"self\.(_[a-z]\w*)", body))
    unread = {name for name, count in targets.items() if count == every[name]}
    for unit in units:
        unit.lines = [kept for line in unit.lines if (kept := _without(line, unread)) is not None]
        if "\n".join(unit.lines).count("width") == 1:
            unit.lines = [line for line in unit.lines if line.strip() != "width = self.WIDTH"]
        unit.lines = _without_empty(unit.lines)


def _without_empty(lines: list[str]) -> list[str]:
    """Return lines without conditions that nothing stands under any more."""
    kept: list[str] = []
    for line in [*lines, ""]:
        depth = len(line) - len(line.lstrip())
        while kept and kept[-1].endswith(":") and kept[-1].lstrip().startswith("if "):
            if len(kept[-1]) - len(kept[-1].lstrip()) < depth:
                break
            kept.pop()
        kept.append(line)
    return kept[:-1]


def _targets(line: str) -> str:
    found = ASSIGNED.match(line)
    return found[1] if found else ""


def _without(line: str, unread: set[str]) -> str | None:
    """Return an assignment without targets that nothing reads, None if no other is left."""
    found = ASSIGNED.match(line)
    if found is None or CALL.search(line[found.end() :]):
        return line
    targets = re.findall(r"self\.\w+ [-+|&^]?= ", found[1])
    kept = [t for t in targets if TARGET.findall(t)[0] not in unread]
    if not kept:
        return None
    indent = line[: len(line) - len(line.lstrip())]
    return f"{indent}{''.join(kept)}{line[found.end() :]}"


def _is_offered(name: str) -> bool:
    """Whether a host may use a method or constant."""
    if name.isupper():
        return name in OFFERED
    return not name.startswith("_") or name.endswith("__")


def _units(text: str) -> list[Unit]:
    """Return what stands before the first method or table, then each of those."""
    units = [Unit([], "")]
    ended = True
    for line in text.splitlines():
        stripped = line[4:]
        if line[:4] == "    " and ended and OPENING.match(stripped):
            before = units[-1].lines
            moved: list[str] = []
            while before and (not before[-1] or SECTION.fullmatch(before[-1].strip())):
                moved.insert(0, before.pop())
            units.append(Unit([*moved, line], ""))
            ended = not stripped.startswith("@")
        else:
            units[-1].lines.append(line)
        if not ended and stripped.startswith("def "):
            ended = True
    for unit in units[1:]:
        found = re.search(r"^    (?:def )?(\w+)(?:\(|:| =)", "\n".join(unit.lines), re.MULTILINE)
        unit.name = found[1] if found else ""
    return units


def _declared(head: Unit, used: set[str]) -> list[str]:
    """Return the head of a class without private variables that are not used."""
    kept = []
    for line in head.lines:
        found = re.fullmatch(r' +"?(_[a-z]\w*)"?(?:,|: .*)', line)
        if found is None or f".{found[1]}" in used:
            kept.append(line)
    return kept


def _without_sections(lines: list[str]) -> list[str]:
    """Return lines without the headings of sections that are empty."""
    kept: list[str] = []
    for line in lines:
        if SECTION.fullmatch(line.strip()):
            while kept and (not kept[-1] or SECTION.fullmatch(kept[-1].strip())):
                kept.pop()
            kept.append("")
        kept.append(line)
    return kept
