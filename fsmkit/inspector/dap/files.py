"""Files and positions as an editor counts them: UTF-16, from 0 or 1, paths or URIs."""

from __future__ import annotations

import os
from itertools import accumulate
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

from fsmkit.diagnostics import Source, Span
from fsmkit.diagnostics.paths import is_file
from fsmkit.emit import plain
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap import requests as ask
from fsmkit.inspector.dap.places import Places, real_path


class Files:
    """The files of a session, for one editor."""

    def __init__(self, places: Places, client: ask.Initialize) -> None:
        self._sources = places.sources
        self._first_line = int(client.lines_start_at_1)
        self._first_column = int(client.columns_start_at_1)
        self._with_uris = client.path_format == "uri"

    # --- to the editor ---------------------------------------------------------------------------

    def source(self, source: Source) -> dict[str, Any]:
        """Return a source: by path, or, where no file is, by a number (see `text`)."""
        path = real_path(source.name)
        name = plain(Path(source.name).name)
        if not is_file(Path(path)):
            return {"name": name, "sourceReference": list(self._sources).index(path) + 1}
        whole = os.path.abspath(source.name)  # noqa: PTH100  (a link stays as the editor has it)
        return {"name": name, "path": Path(whole).as_uri() if self._with_uris else plain(whole)}

    def all(self) -> list[dict[str, Any]]:
        """Return all sources."""
        return [self.source(source) for source in self._sources.values()]

    def start(self, span: Span) -> dict[str, int]:
        """Return the start of a span."""
        return self.position(span.source, *span.source.position(span.start))

    def position(self, source: Source, line: int, column: int) -> dict[str, int]:
        """Return a line and a column, given from 1 and in characters."""
        before = source.line(line)[: column - 1]
        return {
            "line": line - 1 + self._first_line,
            "column": self.width(before) + self._first_column,
        }

    # --- from the editor -------------------------------------------------------------------------

    def path(self, given: ask.File) -> str:
        """Return the real path of a source."""
        if given.source_reference:
            return real_path(self._by_number(given.source_reference).name)
        text = given.path or ""
        if text.startswith("file:"):
            text = url2pathname(urlsplit(text).path)
        try:
            return real_path(text)
        except ValueError as error:  # a null byte
            raise wrong(f"`{text!r}` is not a path") from error

    def known(self, path: str) -> Source | None:
        """Return the source of a real path, if a machine has it."""
        return self._sources.get(path)

    def line(self, line: int) -> int:
        """Return a line from 1."""
        return line + 1 - self._first_line

    def column(self, path: str, line: int, column: int | None) -> int | None:
        """Return a column from 1, in characters; ``line``: from 1."""
        source = self._sources.get(path)
        if column is None or source is None or not 1 <= line <= source.text.count("\n") + 1:
            return None
        units = column - self._first_column
        text = source.line(line)
        return next((n for n in range(len(text)) if self.width(text[:n]) >= units), len(text)) + 1

    def before(self, text: str, line: int | None, column: int) -> str:
        """Return the part of the line before the cursor."""
        lines = text.split("\n")
        number = self.line(line if line is not None else self._first_line) - 1
        shown = lines[number] if 0 <= number < len(lines) else ""
        units = column - self._first_column
        ends = accumulate(map(self.width, shown), initial=0)
        return next((shown[:n] for n, end in enumerate(ends) if end >= units), shown)

    @staticmethod
    def width(text: str) -> int:
        """Return the length of a text in units of UTF-16, which the protocol counts."""
        return len(text) + sum(char > "\uffff" for char in text)

    def text(self, number: int) -> str:
        """Return the text of a source that has a number."""
        return plain(self._by_number(number).text)

    def _by_number(self, number: int) -> Source:
        if not 1 <= number <= len(self._sources):
            raise wrong(f"there is no source {number}")
        return list(self._sources.values())[number - 1]
