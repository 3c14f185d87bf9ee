"""Bytes as a trace: raw and in frames, in any pieces, read and followed by the interpreter."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from random import Random

import atheris

with atheris.instrument_imports(include=["fsmkit.runtime.tracing"]):
    from devtools.fuzz.fuzzing import fuzz
    from devtools.fuzz.through import SECONDS
    from fsmkit.chart.elaborate import elaborate
    from fsmkit.diagnostics import Findings, Source
    from fsmkit.document.front_ends import FrontEnd
    from fsmkit.plugins import plugin
    from fsmkit.runtime.script import Player, read_line, script_texts
    from fsmkit.runtime.tracing.following import Follower
    from fsmkit.runtime.tracing.framing import cobs_decode, cobs_encode, encode_frames
    from fsmkit.runtime.tracing.numbering import Numbering
    from fsmkit.runtime.tracing.records import Gap, Spoilt
    from fsmkit.runtime.tracing.stream import Line, Stream
    from fsmkit.runtime.tracing.writing import Writer

TEXT = """
chart: Lamp
events: {in: ["press(n 0..9, t symbol)", ask]}
inputs: {dark: bool = false, level: "int16[2]"}
operations: [sense() -> 0..100, click]
data: {light: 0..100 = 0}
initial: off
states:
  off: {on: {press: [{target: on, if: dark and event.n > 3, do: light = sense()}]}}
  on:
    entry: click()
    regions:
      a: {initial: b, states: {b: {on: {ask: c}}, c: {}, h: {history: shallow, default: b}}}
      d: {initial: e, states: {e: {after: {3ms: f}}, f: {}}}
    after: {20ms: off}
"""


def _chart() -> object:
    findings = Findings()
    document = plugin(FrontEnd, "yaml").read(Source("lamp.yaml", TEXT), findings)
    findings.stop_on_errors()
    return elaborate((document,), findings)


CHART = _chart()
NUMBERING = Numbering(CHART)
SCRIPT = (
    "start 7", "input dark 1", 'post press 9 ""', "run 10", "dispatch ask", "run 14", "run 40",
    'post press 3 ""', "input level [3 4]", "run 1500", 'dispatch press 5 ""', "run 4000",
)  # fmt: skip


def seeds() -> Iterator[str]:
    """Yield traces of each level, raw and in frames, as text of one byte a character."""
    for level in (1, 2):
        player, writer, out = Player(CHART), Writer(CHART, level), b""
        for line in script_texts(SCRIPT):
            read, before = read_line(CHART, line), player.snapshot
            done = [each for each in player.play(line) if not isinstance(each, str)]
            if read.verb == "start":
                out += writer.started(before, before.inputs, done[0])
            elif read.verb == "run":
                out += writer.ran(before, player.now, done)
            elif read.verb == "dispatch" and before.running:
                out += writer.ran(before, player.now, done, read.event)
        yield (b"\0" + out).decode("latin-1")
        yield (b"\1" + encode_frames(out)).decode("latin-1")


def mutate(content: bytes, most: int, seed: int) -> bytes:
    """Change bytes."""
    random = Random(seed)
    changed = bytearray(content[:most])
    if not changed or random.random() < 0.5:
        return atheris.Mutate(content, most)
    for _ in range(random.choice((1, 1, 2, 4))):
        changed[random.randrange(len(changed))] = random.randrange(256)
    return bytes(changed)


def cross(first: bytes, second: bytes, most: int, seed: int) -> bytes:
    """Return the first trace with a piece of the second in it."""
    random = Random(seed)
    at, begin = random.randrange(len(first) + 1), random.randrange(len(second) + 1)
    return (first[:at] + second[begin : begin + random.randrange(200)] + first[at:])[:most]


def target(content: bytes) -> None:
    """Read and follow records; unreadable bytes must be counted."""
    started = time.process_time()
    data = content[1:]
    with suppress(UnicodeError):  # seeds are written as text
        data = data.decode("utf-8").encode("latin-1")
    stream, follower = Stream([NUMBERING]), Follower()
    reader = Line(stream) if content[:1] == b"\1" else stream
    half = len(data) // 2
    timed = [*reader.feed(data[:half]), *reader.feed(data[half:]), *reader.end()]
    for each in timed:
        list(follower.follow(each, stream.of.get(each.instance)))
    spoilt = sum(each.told.size for each in timed if isinstance(each.told, Spoilt))
    assert spoilt == stream.counts.spoilt <= len(data)
    if reader is stream:
        assert not any(isinstance(each.told, Gap) for each in timed)
    plain = cobs_decode(data)
    assert plain is None or cobs_decode(cobs_encode(plain)) == plain
    assert time.process_time() - started < SECONDS, "too slow"


if __name__ == "__main__":
    fuzz(target, seeds, mutate, cross)
