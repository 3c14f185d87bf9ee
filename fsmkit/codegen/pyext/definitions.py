"""The Python definitions of an extension module, and its type stub."""

from __future__ import annotations

from fsmkit.codegen.pyext.members import Module, fields_of, posted
from fsmkit.codegen.python.content import Needs
from fsmkit.codegen.python.generate import enumerations, host
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.sending import annotation
from fsmkit.emit import printing, python
from fsmkit.language import Field

IMPORTS = "from enum import IntEnum\nfrom typing import Any, Protocol"
STUB = '''\
"""Types of the extension module {module}; made by fsmkit from {source}."""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, ClassVar, Protocol
'''
FIXED = (
    "def __init__(self, operations: object | None = None) -> None: ...",
    "def start(self, now: int = 0) -> None: ...",
    "def run(self, now: int) -> bool: ...",
    "def post(self, event: str, /, *payload: Any) -> bool: ...",
    "def dispatch(self, event: str, /, *payload: Any, now: int | None = None) -> bool: ...",
    "def next_deadline(self) -> int | None: ...",
    "def is_in(self, state: str, /) -> bool: ...",
    "def active(self) -> tuple[str, ...]: ...",
)

SAVING = (
    "def save(self, now: int | None = None) -> bytes: ...",
    "def restore(self, saved: bytes, now: int = 0) -> None: ...",
)


def definitions(module: Module) -> str:
    """Return the enumerations and the protocol of the host, which the module executes."""
    return "\n\n\n".join((IMPORTS, *_shared(module))) + "\n"


@printing
def stub_text(module: Module) -> str:
    """Return the ``.pyi`` of the module, for type checkers and editors."""
    chart = module.chart
    source = chart.sources[0].name if chart.sources else "a chart"
    source = python.source_name(source)
    head = STUB.format(module=module.name, source=source).rstrip("\n")
    return "\n\n".join((head, *_shared(module), _class(module))) + "\n"


def _shared(module: Module) -> list[str]:
    members = [(each.member, Needs(emitted=set(each.emitted))) for each in module.bound.everyone]
    texts = [
        *enumerations(module.bound.member.names),
        host(module.bound.member.names, members),
    ]
    return [text.strip("\n") for text in texts if text]


def _class(module: Module) -> str:
    chart, names = module.chart, module.bound.member.names
    out = Lines()
    with out.suite(f"class {names.machine}:"):
        out.line("NAME: ClassVar[str]")
        out.lines(f"{n}: ClassVar[tuple[str, ...]]" for n in ("STATES", "EVENTS", "OPERATIONS"))
        for variable in (*chart.inputs, *chart.outputs, *chart.data):
            out.line(f"{names.variables[variable.name]}: {annotation(variable.type)}")
        out.lines(["log: Callable[..., object] | None", "reply: Any"])
        if module.traced:
            out.line("trace: Callable[[str], object] | None")
        for name, type_ in (("running", "bool"), ("finished", "bool"), ("fault", "str | None")):
            out.lines(["@property", f"def {name}(self) -> {type_}: ..."])
        if module.recorded:
            out.lines(["@property", "def records(self) -> bytearray: ..."])
        out.lines([*FIXED, *(SAVING if module.saved else ())])
        out.lines(["def coverage(self) -> bytes: ..."] * module.covered)
        for event in posted(chart):
            taken = _arguments(event.fields)
            for verb in ("post", "dispatch"):
                name = f"{verb}_{names.events[event.index]}"
                out.line(f"def {name}(self{taken}) -> bool: ...")
    return out.finish().rstrip("\n")


def _arguments(fields: tuple[Field, ...]) -> str:
    pairs = zip(fields_of(fields), fields, strict=True)
    return "".join(f", {name}: {annotation(part.type)}" for name, part in pairs)
