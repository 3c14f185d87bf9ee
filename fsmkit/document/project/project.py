"""The project file as a value, and its reader."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, Severity, Source, Span, rules
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.keys import Keys
from fsmkit.document.project.keys import CHECK, COMPILE, LEVELS, PROJECT
from fsmkit.document.project.quantities import seconds_of, size_of

PYPROJECT = "pyproject.toml"
OWN = "fsmkit.toml"
PLACE = re.compile(r"at line (\d+), column (\d+)")
QUANTITIES = {"timeout": (seconds_of, "30s"), "memory": (size_of, "2G")}


@dataclass(frozen=True)
class Project:
    """The content of a project file.

    Attributes:
        path: The file.
        search: Folders that are searched for a chart that is not beside the file naming it.
        exclude: Folders, files or patterns, relative to the folder of the project.
        rules: Levels of rules, by name: ``off``, ``note``, ``warning`` or ``error``.
        check: Defaults of `fsmkit check`, by option, as texts.
        compile: The same for `fsmkit compile`.

    """

    path: Path
    search: tuple[Path, ...] = ()
    exclude: tuple[str, ...] = ()
    rules: Mapping[str, str] = field(default_factory=dict)
    check: Mapping[str, str] = field(default_factory=dict)
    compile: Mapping[str, str] = field(default_factory=dict)

    def excludes(self, path: Path) -> bool:
        """Return whether a search of a folder excludes a file or a folder."""
        try:
            below = path.resolve().relative_to(self.path.parent.resolve())
        except (OSError, ValueError):
            return False
        parts = [str(below), *(str(parent) for parent in below.parents)]
        patterns = [pattern.rstrip("/").removeprefix("./") for pattern in self.exclude]
        return any(fnmatchcase(part, pattern) for part in parts for pattern in patterns)


def read_project(path: Path, text: str, findings: Findings) -> Project | None:
    """Return the content of a project file; None for a `pyproject.toml` without our table.

    Errors are findings, and the rest of the file still counts.
    """
    source = Source(str(path), text)
    try:
        table: Any = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if path.name == PYPROJECT and "tool.fsmkit" not in text:
            return None
        place = PLACE.search(str(error))
        at = 0 if place is None else source.offset(int(place[1]), int(place[2]))
        message = f"this is not TOML: {str(error).split(' (at ')[0].lower()}"
        advice = 'put a text in quotes, `name = "value"`; a table is `[name]`'
        findings.add("broken-project", message, Span(source, at, at + 1), help=advice)
        return Project(path)
    within: tuple[str, ...] = ()
    if path.name == PYPROJECT:
        tool = table.get("tool")
        if not isinstance(tool, dict) or "fsmkit" not in tool:
            return None
        table, within = tool["fsmkit"], ("tool", "fsmkit")
    return _Reader(source, findings, within).project(path, table)


class _Reader:
    """Reads the tables; places are found by the names of the keys, as `tomllib` has none."""

    def __init__(self, source: Source, findings: Findings, within: tuple[str, ...]) -> None:
        self._source, self._findings, self._within = source, findings, within

    def project(self, path: Path, table: Any) -> Project:
        parts = self._table(table, PROJECT, "the project")
        folder = path.parent
        return Project(
            path,
            tuple(folder / name for name in self._names(parts, "search")),
            tuple(self._names(parts, "exclude")),
            dict(self._rules(parts.get("rules", {}))),
            dict(self._texts(parts, "check", CHECK)),
            dict(self._texts(parts, "compile", COMPILE)),
        )

    def _table(self, value: Any, known: Keys, what: str, *keys: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            self._wrong(f"{what} must be a table", *keys, advice="write `[name]` above its keys")
            return {}
        for key in value:
            if key not in known:
                otherwise = f"use one of {', '.join(known)}"
                if key == "tool":
                    otherwise = f"in `{OWN}` the keys stand without `tool.fsmkit`"
                self._findings.add(
                    "unknown-key", f"{what} has no key `{key}`", self._place(*keys, key),
                    help=suggest(key, known, otherwise),
                )  # fmt: skip
        return {key: one for key, one in value.items() if key in known}

    def _names(self, parts: Mapping[str, Any], key: str) -> list[str]:
        value = parts.get(key, [])
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
            advice = f'write `{key} = ["charts"]`'
            self._wrong(f"`{key}` must be a list of paths", key, advice=advice)
            return []
        return names

    def _texts(self, parts: Mapping[str, Any], key: str, known: Keys) -> Iterator[tuple[str, str]]:
        for name, value in self._table(parts.get(key, {}), known, f"`{key}`", key).items():
            read, example = QUANTITIES.get(name, (str, ""))
            if not isinstance(value, str) or not value:
                advice = f'write `{name} = "{example or "c"}"`'
                self._wrong(f"`{name}` must be a text", key, name, advice=advice)
            elif read(value) is None:
                advice = f'write `{name} = "{example}"`'
                self._wrong(f"`{name}` cannot be `{value}`", key, name, advice=advice)
            else:
                yield name, value

    def _rules(self, value: Any) -> Iterator[tuple[str, str]]:
        known = {key: rule for rule in rules() for key in (rule.name, rule.code)}
        if not isinstance(value, dict):
            advice = 'write `[rules]`, and below it `unread-data = "off"`'
            self._wrong("`rules` must be a table", "rules", advice=advice)
            return
        for name, level in value.items():
            rule = known.get(name)
            if rule is None:
                self._findings.add(
                    "unknown-key", f"rule `{name}` does not exist", self._place("rules", name),
                    help=suggest(name, known, "`fsmkit explain` lists them"),
                )  # fmt: skip
            elif level not in LEVELS:
                message = f"a rule is off, note, warning or error, not `{level}`"
                self._wrong(message, "rules", name, advice=f'write `{name} = "off"`')
            elif rule.severity is Severity.ERROR and level != "error":
                advice = "remove this line"
                self._wrong(
                    f"`{rule.name}` is an error, which stays one", "rules", name, advice=advice
                )
            else:
                yield rule.name, level

    def _wrong(self, message: str, *keys: str, advice: str) -> None:
        self._findings.add("broken-project", message, self._place(*keys), help=advice)

    def _place(self, *keys: str) -> Span:
        """Return where a key stands, as far as a search for its name shows it."""
        text, at, end = self._source.text, 0, 0
        for key in (*self._within, *keys):
            pattern = rf"(?<![\w-])(?P<quote>[\"']?){re.escape(key)}(?P=quote)(?=\s*[\].=])"
            match = re.compile(pattern).search(text, end)
            if match is None:
                break
            at, end = match.span()
        return Span(self._source, at, max(end, at + 1))
