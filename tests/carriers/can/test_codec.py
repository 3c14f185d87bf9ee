"""The codec in C against cantools: each value, each refusal, and the bytes that are sent."""

from __future__ import annotations

import math
import os
import random
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from fsmkit.carriers.can.dbc import Dbc, Message, encode, read_dbc
from fsmkit.carriers.can.message import CanWire
from fsmkit.carriers.can.tables import message_row
from fsmkit.diagnostics import Findings
from fsmkit.emit import Emitter
from fsmkit.runtime.links.codec import layout
from tests.carriers.can.conftest import FOLDERS, HEATER, HERE, source_of
from tests.carriers.can.test_dbc import NESTED, random_file

pytestmark = [pytest.mark.external, pytest.mark.cc]

FRAMES = int(os.environ.get("FSMKIT_CAN_FRAMES", "4000"))
FILES = 60
BYTES = 64
WIDE = """\
VERSION ""
BU_: A B
BO_ 1 a: 8 A
 SG_ s : 0|64@1- (1,0) [0|0] "" B
BO_ 2 b: 8 A
 SG_ s : 7|64@0+ (1,0) [0|0] "" B
BO_ 3 c: 8 A
 SG_ s : 0|32@1- (1,0) [0|0] "" B
 SG_ t : 39|32@0- (1,0) [0|0] "" B
BO_ 4 d: 8 A
 SG_ s : 0|64@1- (1,0) [0|0] "" B
BO_ 5 e: 8 A
 SG_ s : 3|61@1- (-0.5,-7) [-1e12|1e11] "" B
BO_ 2147483654 f: 3 A
 SG_ s : 5|3@1+ (1,0) [0|0] "" B
 SG_ t : 14|9@0- (0.1,1000) [1000|1001] "" B
BO_ 7 g: 24 A
 SG_ s : 100|33@1- (1,0) [-5|5000000000] "" B
SIG_VALTYPE_ 3 s : 1;
SIG_VALTYPE_ 3 t : 1;
SIG_VALTYPE_ 4 s : 2;
VAL_ 2147483654 s 1 "one" 6 "six" 7 "seven" ;
"""


def load(text: str) -> Dbc:
    found = read_dbc(Path("bus.dbc"), text.encode("cp1252"), Findings())
    assert found is not None
    return found


def all_messages() -> list[tuple[Message, Any]]:
    """Return messages, each with that of cantools; of files in which nothing was refused."""
    found = []
    for text in (WIDE, HEATER.read_text(), NESTED, *map(random_file, range(FILES))):
        dbc = load(text)
        for message in dbc.messages:
            theirs = dbc.database.get_message_by_frame_id(message.frame, message.is_extended)
            if message.selectors or len(theirs.signals) == len(message.signals):
                found.append((message, theirs))
    assert len(found) > FILES // 3
    return found[:250]


def compile_player(messages: list[tuple[Message, Any]], folder: Path, gcc: str) -> Path:
    out, rows = Emitter(), []
    out.line('#include "fsm_can.h"')
    for number, (message, _) in enumerate(messages):
        parts = tuple((signal, place) for place, signal in enumerate(message.signals))
        types = [signal.type for signal in message.signals]
        rows.append(message_row(out, f"m{number}", CanWire(message, 1, parts), types))
    with out.block("static const fsm_can_message messages[] = {", "};"):
        out.lines(rows)
    (folder / "tables.h").write_text(out.finish())
    command = [gcc, "-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow"]
    command += ["-Wconversion", "-Werror", "-fsanitize=undefined,address", f"-I{folder}"]
    command += [f"-I{path}" for path in FOLDERS]
    command += [str(HERE / "can_player.c"), source_of("fsm_can"), source_of("fsm_link")]
    command += ["-o", str(folder / "player")]
    subprocess.run(command, check=True)
    return folder / "player"


def is_within(part: Any, signal: Any, raw: float) -> bool:
    """Whether a raw value is one by what cantools says of its signal."""
    if part.members:
        return raw in signal.choices
    if signal.is_float:
        return True
    physical = raw * Fraction(str(signal.scale)) + Fraction(str(signal.offset))
    least, most = signal.minimum, signal.maximum
    return (least is None or physical >= Fraction(str(least))) and (
        most is None or physical <= Fraction(str(most))
    )


def is_same(value: Any, part: Any, signal: Any, raw: Any) -> bool:
    if part.members:
        return bool(part.members[value] == raw)
    if signal.is_float:
        return bool(value == raw) or (math.isnan(value) and math.isnan(raw))
    scale = Fraction(str(signal.scale))
    return bool(value * abs(scale) == raw * scale + Fraction(str(signal.offset)))


def drawn(draw: random.Random, message: Message) -> bytes:
    """Return the bytes of a frame: now and then too short, often with values in range."""
    if draw.random() < 0.05 and message.length:
        return draw.randbytes(draw.randrange(message.length))
    content = bytearray(draw.randbytes(message.length + draw.choice([0, 0, 0, 1])))
    if draw.random() < 0.7:
        values = [
            draw.random() * 1000
            if not signal.members and signal.bounds == (0, -1)
            else draw.randint(*signal.bounds)
            for signal in message.signals
        ]
        return encode(message, tuple(values))
    return bytes(content)


def test_values_refusals_and_bytes_are_those_of_cantools(
    tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    messages = all_messages()
    player = compile_player(messages, tmp_path, require_tool("gcc"))
    draw = random.Random(5)
    frames = [(draw.randrange(len(messages)), b"") for _ in range(FRAMES)]
    frames = [(number, drawn(draw, messages[number][0])) for number, _ in frames]
    records = b"".join(
        bytes((number, len(content))) + content.ljust(BYTES, b"\0") for number, content in frames
    )
    done = subprocess.run([player], input=records, capture_output=True, check=True)
    size = 2 + 2 * BYTES
    assert len(done.stdout) == size * FRAMES
    taken = refused = 0
    for place, (number, content) in enumerate(frames):
        answer = done.stdout[place * size : (place + 1) * size]
        message, theirs = messages[number]
        raw = None
        if len(content) >= message.length:
            from cantools.database import DecodeError

            try:
                raw = theirs.decode(content, decode_choices=False, scaling=False)
            except DecodeError:
                assert message.selectors
        if raw is not None and any(raw.get(s.name) != n for s, n in message.selectors):
            raw = None
        signals = [] if raw is None else [s for s in theirs.signals if s.name in raw]
        plain = [s for s in signals if not s.is_multiplexer]
        pairs = list(zip(message.signals, plain, strict=True)) if raw is not None else []
        is_taken = raw is not None and all(is_within(p, s, raw[s.name]) for p, s in pairs)
        assert (answer[0] == 0) == is_taken, (message, content.hex(), raw)
        if not is_taken or raw is None:
            refused += 1
            continue
        taken += 1
        packing = layout(tuple(signal.type for signal in message.signals)).packing
        values = packing.unpack(answer[2 : 2 + packing.size])
        for value, (part, signal) in zip(values, pairs, strict=True):
            assert is_same(value, part, signal, raw[signal.name]), (message, content.hex(), raw)
        assert answer[1] == 1
        if not any(math.isnan(value) for value in raw.values()):
            sent = theirs.encode(raw, scaling=False, strict=False)
            assert answer[2 + BYTES :][: message.length] == sent
    sys.stdout.write(f"{len(messages)} messages: {taken} frames taken, {refused} refused\n")
    assert min(taken, refused) > FRAMES // 10
