"""The triggers of a machine: events by name, whatever their case, and the map of other names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from fsmkit.diagnostics import Findings, Text
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import reject
from fsmkit.foreign.words import RESERVED

ENTER, EXIT = "enter", "exit"
PATTERN = re.compile(r"(?:\w|\\d|\\w|\.|\[[\w-]+\])+?(?:[+*?](?:\w|\\d|\\w|\.)*){0,2}")
"""Regular expressions of bounded time: few repetitions, no groups."""


@dataclass
class Triggers:
    """Finds the events of a trigger. Names do not depend on case, as in the tool."""

    findings: Findings
    rows: dict[str, list[str]]
    """The items of each name of the map, in lower case."""
    events: dict[str, Text] = field(default_factory=dict)
    """Events in lower case, with their names in the chart."""
    namer: Namer = field(default_factory=lambda: Namer(RESERVED))

    def declare(self, texts: Iterable[Text]) -> None:
        """Add the events among some triggers, and those that the map names."""
        for text in texts:
            name = text.value.lower()
            if name not in self.rows and name not in (ENTER, "entry", EXIT):
                self._add(name, text)
        for items in list(self.rows.values()):
            for item in items:
                known = item in self.rows or item in (ENTER, "entry", EXIT)
                if re.fullmatch(r"\w+", item) and not known and item not in self.events:
                    at = next(iter(self.events.values()), None)
                    if at is not None:
                        self._add(item, at.with_value(item))

    def _add(self, name: str, text: Text) -> None:
        if name not in self.events:
            written = self.namer.name(text.value, "_event", source=text.value)
            self.events[name] = text.with_value(written)

    def meanings(self, text: Text) -> list[str]:
        """Return what a trigger means: events in lower case, ``enter`` and ``exit``."""
        found: dict[str, None] = {}
        seen: set[str] = set()
        left = [text.value.lower()]
        while left:
            name = left.pop(0)
            if name in seen:
                continue
            seen.add(name)
            if name in self.rows:
                left = [*self.rows[name], *left]
            elif name in (ENTER, "entry"):
                found[ENTER] = None
            elif name == EXIT:
                found[EXIT] = None
            elif name in self.events:
                found[name] = None
            else:
                found |= dict.fromkeys(self._matching(name, text))
        return list(found)

    def _matching(self, item: str, text: Text) -> list[str]:
        """Return the events that a pattern of the map selects."""
        pattern = None
        if re.fullmatch(r"[\w*]+", item):
            pattern = re.escape(item).replace(r"\*", r"\w*")
        elif item.startswith("/") and item.endswith("/") and PATTERN.fullmatch(item[1:-1]):
            pattern = item[1:-1]
        if pattern is None:
            reject(
                self.findings, f"the map of triggers selects events by `{item[:40]}`", text,
                "write a name, or `NAME*`",
            )  # fmt: skip
            return []
        return [name for name in self.events if re.fullmatch(pattern, name)]


def read_map(lines: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """Return the rows of a map of triggers."""
    return {
        left.lower(): [item.strip().lower() for item in right.split(",") if item.strip()]
        for left, right in lines
    }
