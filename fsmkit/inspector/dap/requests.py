"""The arguments of requests, as far as they count here; keys that are not named are passed over."""

from __future__ import annotations

from typing import Any

from msgspec import Struct

from fsmkit.inspector.dap.launching import Launch
from fsmkit.inspector.dap.stops import RequestedBreakpoint

__all__ = ("Launch", "RequestedBreakpoint")


class Request(Struct):
    """A request as such."""

    seq: int
    command: str
    type: str = "request"
    arguments: dict[str, Any] | None = None


class Nothing(Struct):
    """Arguments that do not count."""


class Initialize(Struct, rename={"lines_start_at_1": "linesStartAt1", "columns_start_at_1": "columnsStartAt1", "path_format": "pathFormat"}):  # fmt: skip  # noqa: E501
    """The conventions of the editor for lines, columns and paths."""

    lines_start_at_1: bool = True
    columns_start_at_1: bool = True
    path_format: str | None = "path"


class File(Struct, rename="camel"):
    """A source: by path, or by the number that it was given."""

    path: str | None = None
    source_reference: int | None = None


class SourceBreakpoints(Struct):
    """All breakpoints of a file."""

    source: File
    breakpoints: list[RequestedBreakpoint] | None = None


class Breakpoints(Struct):
    """All breakpoints of names, or of data."""

    breakpoints: list[RequestedBreakpoint]


class Filters(Struct):
    """All exception filters."""

    filters: list[str] = []


class Lines(Struct, rename="camel"):
    """A range of a file."""

    source: File
    line: int
    column: int | None = None
    end_line: int | None = None
    end_column: int | None = None


class Thread(Struct, rename="camel"):
    """A thread."""

    thread_id: int = 1


class Stepping(Struct, rename="camel"):
    """A thread and the size of a step: ``instruction`` is a microstep."""

    thread_id: int = 1
    granularity: str = "statement"


class Stack(Struct, rename="camel"):
    """A part of a stack."""

    thread_id: int
    start_frame: int | None = None
    levels: int | None = None


class OfFrame(Struct, rename="camel"):
    """A frame."""

    frame_id: int


class Variables(Struct, rename="camel"):
    """A range of the members of a scope, an array or a record."""

    variables_reference: int
    start: int | None = None
    count: int | None = None


class SetVariable(Struct, rename="camel"):
    """Another value of a variable."""

    variables_reference: int
    name: str
    value: str


class DataInfo(Struct, rename="camel"):
    """A variable, or without a reference an expression, that may be watched for changes."""

    name: str
    variables_reference: int | None = None
    frame_id: int | None = None


class Evaluate(Struct, rename="camel"):
    """A line of the console, or an expression."""

    expression: str
    frame_id: int | None = None
    context: str | None = None


class Completions(Struct, rename="camel"):
    """A text and the column of the cursor in it."""

    text: str
    column: int
    line: int | None = None
    frame_id: int | None = None


class Source(Struct, rename="camel"):
    """A source whose text is wanted."""

    source_reference: int = 0
    source: File | None = None
