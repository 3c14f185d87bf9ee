"""Bytes as an expression, statements, a type, a duration, a declaration."""

from __future__ import annotations

import time
from collections.abc import Iterator
from random import Random

import atheris

with atheris.instrument_imports(include=["fsmkit"]):
    from devtools.fuzz.fuzzing import fuzz
    from devtools.fuzz.through import SECONDS
    from fsmkit.diagnostics import Findings, Source, Span, Text
    from fsmkit.language import (
        BOOL,
        FLOAT64,
        INT32,
        ArrayType,
        EnumType,
        Field,
        IntType,
        Scope,
        Signature,
        Storage,
        fold,
        format_expression,
        read_duration,
        read_type,
        type_call,
        type_expression,
        type_location,
    )
    from fsmkit.language.statements.reading import read_signature, read_statements, read_typed
    from fsmkit.language.statements.writing import write_statements

from devtools.fuzz.seeds import strings_of_tests
from devtools.fuzz.texts import changed

FAULT = EnumType("Fault", ("none", "lost", "jam"))
RANGE = IntType(0, 4000)


def scope(dialect: str) -> Scope:
    """Return a scope with something of each kind in it."""
    return Scope(
        variables={
            "a": (RANGE, Storage.DATA),
            "b": (INT32, Storage.DATA),
            "f": (FLOAT64, Storage.DATA),
            "flag": (BOOL, Storage.INPUT),
            "list": (ArrayType(RANGE, 4), Storage.DATA),
            "code": (FAULT, Storage.OUTPUT),
        },
        types={"Fault": FAULT},
        operations={"goto": Signature((Field("position", RANGE),), BOOL)},
        states={"idle": 1},
        event_fields={"n": RANGE},
        dialect=dialect,
    )


SCOPES = tuple(scope(dialect) for dialect in ("fsmkit", "ecmascript"))

SEEDS = (
    "0a + b * 2 >= list[1] and not flag or code == lost",
    "1flag ? min(a, 3) : (b / 2) | 0",
    '0if a > 1 { b += 1; send t(n = 2) after 5ms as i } else { log "x", a; cancel i }',
    "0for x in list { raise e(v = x) }; reply 3; goto(event.n)",
    "0goto(position 0..100, n uint8[4]) -> bool",
    "0uint8[4] = [1, 2, 3, 0x4]",
    "01.5s",
    "1typeof x !== 'undefined' && _event.data.n % 3 === 0",
)


NAMES = ("a", "b", "f", "flag", "list", "code", "lost", "goto", "idle", "event.n", "Fault", "x")


def seeds() -> Iterator[str]:
    """Yield sources of each kind, those of the tests in both dialects."""
    yield from SEEDS
    for text in strings_of_tests("expressions", "model", "hostile"):
        if 0 < len(text) < 400:
            yield f"0{text}"
            yield f"1{text}"


def mutate(content: bytes, most: int, seed: int) -> bytes:
    """Change one or two tokens, or some bytes."""
    random = Random(seed)
    if random.random() < 0.2 or not content:
        return atheris.Mutate(content, most)
    text = content[1:].decode("utf-8", errors="replace")
    for _ in range(random.choice((1, 1, 2, 4))):
        text = changed(text, random, NAMES)
    return (content[:1] + text.encode("utf-8", errors="replace"))[:most]


def cross(first: bytes, second: bytes, most: int, seed: int) -> bytes:
    """Return the first text with a piece of the second in it."""
    random = Random(seed)
    at = random.randrange(len(first) + 1)
    begin = random.randrange(len(second) + 1)
    piece = second[begin : begin + random.randrange(100)]
    return (first[:at] + piece + first[at:])[:most]


def target(content: bytes) -> None:
    """Read a source as each possible kind; typed ones are folded and formatted."""
    started = time.process_time()
    value = content[1:].decode("utf-8", errors="replace")
    text = Text(value, Span(Source("fuzz", value), 0, len(value)))
    here = SCOPES[content[0] % 2 if content else 0]
    for read in (type_expression, type_location, type_call, read_type, read_duration):
        findings = Findings()
        result = read(text, here, findings)
        assert (result is None) == findings.has_errors, (read.__name__, value)
        if read is type_expression and result is not None:
            fold(result)
            format_expression(result)
    read_signature(text, Findings())
    read_typed(text, Findings())
    findings = Findings()
    block = read_statements(text, findings)
    if not findings.has_errors:
        write_statements(block)
    assert time.process_time() - started < SECONDS, "too slow"


if __name__ == "__main__":
    fuzz(target, seeds, mutate, cross)
