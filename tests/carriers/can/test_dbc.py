"""DBC files: types of signals, values against cantools, charts of nodes, findings."""

from __future__ import annotations

import os
import random
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fsmkit
from fsmkit.carriers.can.chart_of_dbc import chart_of
from fsmkit.carriers.can.dbc import Dbc, decode, encode, read_dbc
from fsmkit.carriers.can.response_times import frames_of
from fsmkit.cli import execute
from fsmkit.diagnostics import Diagnostic, Findings
from fsmkit.language import EnumType, IntType
from tests.carriers.can.conftest import HEATER

pytestmark = pytest.mark.external

HEAD = 'VERSION ""\nBU_: A B\n'


def load(text: str | bytes) -> tuple[Dbc | None, list[Diagnostic]]:
    findings = Findings()
    content = text.encode("cp1252", errors="replace") if isinstance(text, str) else text
    found = read_dbc(Path("bus.dbc"), content, findings)
    return found, list(findings)


def heater() -> Dbc:
    found, findings = load(HEATER.read_bytes())
    assert found is not None
    assert findings == []
    return found


def test_signals_are_integers_in_units_of_their_factor() -> None:
    dbc = heater()
    by_name = {message.name: message for message in dbc.messages}
    assert list(by_name) == ["heater", "set_power", "status_position", "status_fault"]
    (temperature,) = by_name["heater"].signals
    assert temperature.type == IntType(-400, 1000)
    assert (by_name["heater"].cycle, by_name["set_power"].cycle) == (10, 0)
    (place,) = by_name["status_position"].signals
    assert place.type == IntType(-122, 133)
    mode = by_name["status_fault"].signals[1]
    assert isinstance(mode.type, EnumType)
    assert tuple(map(str, mode.type.members)) == ("off_2", "heating_up", "failed")
    assert mode.members == (0, 1, 3)
    assert dbc.source.text[temperature.span.start : temperature.span.end] == "temperature"


def test_the_chart_of_a_node_is_what_the_documents_show(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "heater.yaml"
    command = ["convert", str(HEATER), "--to", "yaml", "--node", "HEATER", "--out", str(out)]
    assert execute([*command, "--may", "bus_off"]) == 0
    text = out.read_text()
    for line in (
        "any_temperature() -> -400..1000",
        "temperature: -400..1000 = 0",
        "set_power(percent 0..100)",
        "status_position(place -122..133)",
        "9ms..11ms: {target: heater_talking, do: temperature = any_temperature()}",
        "14ms..25ms: {target: heater_gone, do: send heater_silent}",
        "100ms..1s: heater_talking",
    ):
        assert line in text
    chart = fsmkit.read(out)
    assert isinstance(chart, fsmkit.Chart)
    assert execute(command) == 0
    assert "silent" not in out.read_text()
    assert execute([*command[:-4], "--out", str(out)]) == 2
    assert "write `--node` with one of CONTROL, HEATER" in capsys.readouterr().err


def test_options_of_a_bus_are_refused_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    chart = "machines/production_cell/feeder.yaml"
    assert execute(["convert", chart, "--to", "scxml", "--node", "x"]) == 2
    assert "is not a DBC file" in capsys.readouterr().err


def random_file(seed: int) -> str:
    """Return a DBC file of one message, its signals anywhere."""
    draw = random.Random(seed)
    lines = [HEAD, "BO_ 100 m: 8 A"]
    free = set(range(64))
    for number in range(draw.randint(1, 6)):
        bits = draw.randint(1, 24)
        is_big = draw.random() < 0.5
        start = draw.randrange(64)
        first = start // 8 * 8 + 7 - start % 8
        places = range(first, first + bits) if is_big else range(start, start + bits)
        used = {p // 8 * 8 + 7 - p % 8 if is_big else p for p in places}
        if not used <= free:
            continue
        free -= used
        sign = draw.choice("+-")
        factor = draw.choice(["1", "0.1", "2", "-0.25", "10", "0.001"])
        offset = draw.choice(["0", "0", "40", "-100"])
        lo, hi = sorted(draw.randint(-3000, 3000) for _ in "ab")
        limits = draw.choice(["[0|0]", f"[{lo}|{hi}]"])
        lines.append(
            f" SG_ s{number} : {start}|{bits}@{0 if is_big else 1}{sign} ({factor},{offset}) "
            f'{limits} "" B'
        )
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", range(40))
def test_values_and_refusals_are_those_of_cantools(seed: int) -> None:
    """Physical values by `cantools`, beside their minimum and maximum as they are written."""
    dbc, findings = load(random_file(seed))
    assert dbc is not None
    if any(finding.rule.name != "broken-dbc" for finding in findings):
        pytest.fail(str(findings))
    (message,) = dbc.messages
    theirs = dbc.database.messages[0]
    sound = {part.name for part in message.signals}
    draw = random.Random(seed)
    for _ in range(200):
        content = draw.randbytes(8)
        physical = theirs.decode(content, decode_choices=False)
        is_within = True
        for signal in theirs.signals:
            value = physical[signal.name]
            if signal.name in sound and not (
                (signal.minimum is None or value > signal.minimum - 1e-9)
                and (signal.maximum is None or value < signal.maximum + 1e-9)
            ):
                is_within = False
        found = decode(dbc.messages, content)
        assert (found is not None) == is_within
        if found is None:
            continue
        _, values = found
        for part, value in zip(message.signals, values, strict=True):
            scale = next(s.scale for s in theirs.signals if s.name == part.name)
            assert value * abs(scale) == pytest.approx(physical[part.name], abs=1e-6)
        again = decode(dbc.messages, encode(message, values))
        assert again == found


@pytest.mark.parametrize(
    ("text", "message", "place"),
    [
        ("BO_ 1 x", "syntax", " "),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (1,0) [0|0] "" B\n'
         ' SG_ c : 4|8@1+ (1,0) [0|0] "" B\n', "does not fit", "c"),
        (HEAD + 'BO_ 256 a: 2 A\n SG_ b : 0|8@1+ (1,0) [0|0] "" B\n'
         ' SG_ c : 4|8@1+ (1,0) [0|0] "" B\n', "overlapping", "c"),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (0,0) [0|0] "" B\n', "factor 0", "b"),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (0.1,0.05) [0|0] "" B\n', "not a multiple", "b"),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (1,0) [300|400] "" B\n', "no value", "b"),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (1,0) [9|4] "" B\n', "no value", "b"),
        (HEAD + 'BO_ 256 a: 1 A\n SG_ b : 0|8@1+ (1,0) [0|0] "" B\nBO_ 256 c: 1 A\n',
         "identifier of `a`", "a"),
        (HEAD + "BO_ 9999 a: 1 A\n", "more than 11 bits", "a"),
        (HEAD + "BO_ 256 a: 99 A\n", "has 99 bytes", "a"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_a_finding_at_its_place(text: str, message: str, place: str) -> None:
    _, findings = load(text)
    found = [f for f in findings if f.rule.name == "broken-dbc" and message in f.message]
    assert found, findings
    assert found[0].primary is not None
    span = found[0].primary.span
    if place != " ":
        assert text[span.start : span.end] == place


@pytest.mark.parametrize("content", [b"", b"\x00\xff", b"BO_ " * 100, b"(" * 5000, b'VERSION "\n'])
def test_what_is_no_dbc_file_is_refused(content: bytes) -> None:
    found, findings = load(content)
    assert found is None
    assert [finding.rule.name for finding in findings] == ["broken-dbc"]


NESTED = (
    HEAD
    + """\
BO_ 100 plain: 1 A
 SG_ x : 0|8@1+ (1,0) [0|0] "" B
BO_ 256 deep: 8 A
 SG_ s0 M : 0|2@1+ (1,0) [0|0] "" B
 SG_ s1 m0M : 2|4@1+ (1,0) [0|0] "" B
 SG_ s2 m4 : 10|4@1+ (1,0) [0|0] "" B
 SG_ s3 m3M : 16|4@1+ (1,0) [0|0] "" B
 SG_ s4 m1 : 20|8@1+ (1,0) [0|0] "" B
 SG_ s5 m6 : 10|4@1+ (1,0) [0|0] "" B
 SG_ s6 m2 : 2|4@1+ (1,0) [0|0] "" B
 SG_ s7 : 56|8@1- (1,0) [0|0] "" B
SG_MUL_VAL_ 256 s1 s0 0-0;
SG_MUL_VAL_ 256 s2 s1 4-4;
SG_MUL_VAL_ 256 s3 s1 3-3;
SG_MUL_VAL_ 256 s4 s3 1-1, 5-6;
SG_MUL_VAL_ 256 s5 s1 6-6;
SG_MUL_VAL_ 256 s6 s0 2-2;
"""
)


def test_multiplexers_within_multiplexers_are_events() -> None:
    dbc, findings = load(NESTED)
    assert findings == []
    assert dbc is not None
    deep = dbc.by_frame[256, False]
    assert {message.name: [s.name for s in message.signals] for message in deep} == {
        "deep_m0_m3_m1": ["s4", "s7"],
        "deep_m0_m3_m5": ["s4", "s7"],
        "deep_m0_m3_m6": ["s4", "s7"],
        "deep_m0_m4": ["s2", "s7"],
        "deep_m0_m6": ["s5", "s7"],
        "deep_m2": ["s6", "s7"],
    }
    from cantools.database import DecodeError

    theirs = dbc.database.get_message_by_name("deep")
    draw = random.Random(7)
    taken = 0
    for _ in range(3000):
        content = draw.randbytes(8)
        try:
            expected = theirs.decode(content)
        except DecodeError:
            expected = None
        found = decode(deep, content)
        assert (found is None) == (expected is None)
        if found is None or expected is None:
            continue
        taken += 1
        message, values = found
        given = dict(zip((s.name for s in message.signals), values, strict=True))
        given |= {signal.name: number for signal, number in message.selectors}
        assert given == expected
        assert decode(deep, encode(message, values)) == found
    assert taken > 100


@pytest.mark.parametrize(
    ("rows", "count"),
    [
        ("SG_MUL_VAL_ 256 s1 s0 0-2000;\n", "1024"),
        ("SG_MUL_VAL_ 256 s1 s0 0-40;\nSG_MUL_VAL_ 256 s2 s1 0-40;\n", "1024"),
        ("", "`s1`"),
    ],
)
def test_a_message_that_is_too_much_is_omitted_alone(rows: str, count: str) -> None:
    text = (
        HEAD
        + """\
BO_ 256 much: 8 A
 SG_ s0 M : 0|16@1+ (1,0) [0|0] "" B
 SG_ s1 m0M : 16|8@1+ (1,0) [0|0] "" B
 SG_ s2 m0 : 24|8@1+ (1,0) [0|0] "" B
BO_ 257 plain: 1 A
 SG_ x : 0|8@1+ (1,0) [0|0] "" B
"""
        + rows
    )
    if "s2 s1" not in text and rows:
        text = text.replace(' SG_ s2 m0 : 24|8@1+ (1,0) [0|0] "" B\n', "").replace("m0M", "m0")
    dbc, (finding,) = load(text)
    assert (finding.rule.name, count in finding.message) == ("omitted-message", True)
    assert finding.primary is not None
    assert dbc is not None
    assert [message.name for message in dbc.messages] == ["plain"]


HOSTILE_NUMBERS = [
    *("1e400", "-1e400", "1e-999999999", "1e999999999", "9" * 5000, "0." + "3" * 5000, "-1", "0"),
    *("999999999", "4294967295", "18446744073709551616", "1.5", "1e3", "1e-3", "65", "512", ""),
    *("9" * 64, "1e300", "-1e300", "0x10", "nan", "inf", "1.2.3", "1e", "--1"),
]


@pytest.mark.slow
def test_any_number_in_a_file_gives_findings_or_a_chart_at_once() -> None:
    """Each number of two files is replaced by each hostile one; FSMKIT_DBC_NUMBERS: how many."""
    found = [
        (text, place, number)
        for text in (HEATER.read_text(), NESTED)
        for place in re.finditer(r"(?<![A-Za-z_])m?\d[\d.]*", text)
        for number in HOSTILE_NUMBERS
    ]
    count = int(os.environ.get("FSMKIT_DBC_NUMBERS", "300"))
    for text, place, number in random.Random(1).sample(found, min(count, len(found))):
        dbc, findings = load(text[: place.start()] + number + text[place.end() :])
        if dbc is None:
            assert findings, (place, number)
            assert all(finding.primary is not None for finding in findings)
            continue
        for node in dbc.nodes:
            chart_of(dbc, node, may_fall_silent=True)
        frames_of(dbc, 500_000)


HOSTILE = [
    *("true", "null", "on", "off", "if", "In", "event", "super", "send", "not", "raise", "states"),
    *("chart", "initial", "min", "max", "len", "after", "int", "self", "bool", "running", "any"),
    *("_", "__", "x__y", "X", "x", "uint8", "duration", "float32", "abs", "reply", "quiet"),
]


def test_hostile_names_become_names_of_a_chart_that_is_read(tmp_path: Path) -> None:
    lines = [HEAD]
    for number, name in enumerate(HOSTILE):
        frame = 100 + number
        lines.append(f'BO_ {frame} {name}: 8 A\n SG_ {name} : 0|8@1+ (1,0) [0|0] "" B')
        lines.append(f' SG_ {name}_ : 8|8@1+ (1,0) [0|0] "" B\n')
    lines.append('BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;\nBA_DEF_DEF_ "GenMsgCycleTime" 0;\n')
    for number, name in enumerate(HOSTILE):
        if number % 2:
            lines.append(f'BA_ "GenMsgCycleTime" BO_ {100 + number} 10;\n')
        else:
            values = '0 "true" 1 "x; exit(1)" 2 "" 3 "\u00e4\'{}" 4 "super" 5 "Off"'
            lines.append(f"VAL_ {100 + number} {name} {values} ;\n")
    path = tmp_path / "hostile.dbc"
    path.write_bytes("".join(lines).encode("cp1252"))
    for node in "AB":
        for notation in ("yaml", "scxml"):
            out = tmp_path / f"{node}.{notation}"
            command = ["convert", str(path), "--to", notation, "--node", node, "--out", str(out)]
            assert execute([*command, "--may", "bus_off"]) == 0
            chart = fsmkit.read(out)
            assert isinstance(chart, fsmkit.Chart)


names = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,12}", fullmatch=True)


@settings(max_examples=40, deadline=None)
@given(found=st.lists(names, min_size=1, max_size=5, unique=True), choice=st.text(max_size=12))
def test_any_names_and_any_texts_give_a_chart(
    found: list[str], choice: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    quoted = choice.replace("\\", "").replace('"', "")
    text = HEAD + "".join(
        f'BO_ {n + 1} {name}: 1 A\n SG_ {name} : 0|8@1+ (1,0) [0|0] "" B\n'
        for n, name in enumerate(found)
    )
    text += "".join(f'VAL_ {n + 1} {name} 0 "{quoted}" 1 "one" ;\n' for n, name in enumerate(found))
    dbc, findings = load(text)
    if dbc is None:  # a keyword of DBC files as a name, or a text that ends the file
        assert findings
        return
    path = tmp_path_factory.mktemp("any") / "a.yaml"
    path.write_text(chart_of(dbc, "A", may_fall_silent=True), encoding="utf-8")
    assert isinstance(fsmkit.read(path), fsmkit.Chart)


def test_a_large_file_is_read() -> None:
    """A thousand messages with eight signals each, as a car has them."""
    lines = [HEAD]
    for number in range(1000):
        lines.append(f"BO_ {number + 1} message_{number}: 8 {'AB'[number % 2]}")
        lines += [f' SG_ s{n} : {8 * n}|8@1+ (1,0) [0|0] "" {"BA"[number % 2]}' for n in range(8)]
        lines.append("")
    dbc, findings = load("\n".join(lines))
    assert findings == []
    assert dbc is not None
    assert len(dbc.messages) == 1000
