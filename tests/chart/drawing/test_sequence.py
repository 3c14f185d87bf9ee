"""Sequence diagrams: what repeats is told once, texts are escaped, long ones are cut in bands."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import pytest

from fsmkit.verify.report.sequences import mermaid, plantuml, svg, terminal
from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Lifeline,
    Part,
    Repetition,
    Sequence,
    Transport,
    fold_repetitions,
)


def block(number: int, text: str, *, arrows: tuple[Arrow, ...] = ()) -> Block:
    return Block(
        number, f"{number}ms", 0, Cause.OUTSIDE, text, is_shown=False, entered=(f"s_{text}",),
        active=(f"s_{text}",), arrows=arrows,
    )  # fmt: skip


def diagram(*parts: Block | Repetition) -> Sequence:
    lifelines = (Lifeline("guard[0]"), Lifeline("plant & <co>", is_environment=True))
    return Sequence('A: "P"', lifelines, parts, ("violated: P: a < b; end #1",), violated=True)


def test_what_repeats_is_told_once() -> None:
    blocks = (*(block(n, "abc"[n % 3]) for n in range(9)), block(9, "z"))
    first, last = fold_repetitions(blocks)
    assert isinstance(first, Repetition)
    assert (first.times, [b.text for b in first.blocks]) == (3, ["a", "b", "c"])
    assert last == blocks[-1]


def test_what_repeats_too_little_is_told_as_it_is() -> None:
    blocks = tuple(block(n, "ab"[n % 2]) for n in range(4))
    assert fold_repetitions(blocks) == blocks


def test_folding_loses_no_step() -> None:
    texts = "xababababyzzzzzzzq" + "abcd" * 7
    blocks = tuple(block(n, text) for n, text in enumerate(texts))
    unfolded = ""
    for part in fold_repetitions(blocks):
        each = part.blocks if isinstance(part, Repetition) else (part,)
        times = (part.times or 0) if isinstance(part, Repetition) else 1
        unfolded += "".join(b.text for b in each) * times
    assert unfolded == texts


AWKWARD = 'end "a" ; #1 <b> & `c` **d** \\n %x\u0007'


@pytest.mark.parametrize("part", Part)
@pytest.mark.parametrize("transport", Transport)
def test_svg_is_well_formed_whatever_the_texts_are(transport: Transport, part: Part) -> None:
    drawn = diagram(block(1, AWKWARD, arrows=(Arrow(0, 1, AWKWARD, transport, part),)))
    root = ET.fromstring(svg.draw(drawn))
    texts = "".join(root.itertext())
    for word in ("plant & <co>", "guard[0]", "`c`", "violated: P: a < b"):
        assert word in texts


def test_messages_that_travel_differently_look_different() -> None:
    looks = set()
    for transport in Transport:
        drawn = svg.draw(diagram(block(1, "x", arrows=(Arrow(0, 1, "m", transport),))))
        looks.add(re.sub(r"(event|output)[^<]*", "", drawn))
    assert len(looks) == len(Transport)


def test_a_long_svg_names_the_machines_and_their_states_again() -> None:
    blocks = tuple(block(n, f"event_{n}") for n in range(1, 400))
    root = ET.fromstring(svg.draw(diagram(*blocks)))
    texts = [element.text or "" for element in root.iter()]
    heads = texts.count("guard[0]")
    assert heads >= 15
    assert heads <= 40
    assert int(root.attrib["width"]) < 700
    assert sum(text.startswith("s_event_") for text in texts) > 399


def test_mermaid_has_no_character_of_its_own_in_texts() -> None:
    drawn = mermaid.draw(diagram(block(1, AWKWARD), Repetition((block(2, "x"),), None)))
    lines = drawn.splitlines()
    assert lines[0] == "sequenceDiagram"
    assert "  loop for ever" in lines
    assert sum(line.strip() == "end" for line in lines) == 1
    message = next(line for line in lines if "outside->>m0: " in line).split(": ", 1)[1]
    assert " ".join(re.findall(r"\w+", re.sub(r"#\d+;", "", message))) == "nd a 1 b c d n x"


def test_plantuml_closes_all_it_opens_and_escapes() -> None:
    drawn = plantuml.draw(diagram(block(1, AWKWARD), Repetition((block(2, "x"),), 3)))
    lines = drawn.splitlines()
    assert (lines[0], lines[-1]) == ("@startuml", "@enduml")
    assert lines.count("rnote over m0 #fff8e1") == lines.count("end rnote") == 2
    assert lines.count("loop 3 times alike") == lines.count("end") == 1
    assert "<U+0022>a<U+0022>" in drawn
    assert '"guard[0]" as m0' in drawn


@pytest.mark.parametrize("width", [80, 130])
def test_terminal_lines_fit(width: int) -> None:
    arrows = (
        Arrow(0, 1, "goto(position = 100, speed = 20)", Transport.QUEUED),
        Arrow(1, 0, "position = 100", Transport.VALUE),
        Arrow(1, 0, "late", Transport.LOSSY, Part.LOST),
    )
    lines = terminal.draw(diagram(block(1, "press_start", arrows=arrows)), width)
    assert lines is not None
    texts = [line.text for line in lines]
    assert max(map(len, texts)) <= width
    assert any("press_start ─" in text and "▶│" in text for text in texts)
    assert any("◀┄" in text for text in texts)
    assert any("\N{MULTIPLICATION SIGN}" in text for text in texts)
    assert any("[s_press_start]" in text for text in texts)


def test_too_many_lifelines_for_a_terminal_are_not_drawn() -> None:
    many = replace(diagram(block(1, "x")), lifelines=tuple(Lifeline(f"m{n}") for n in range(9)))
    assert terminal.draw(many, 130) is None
