"""Files nobody should write: each ends soon, in little memory, with findings that have a place."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from os import mkfifo
from pathlib import Path

import pytest

from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.system_file import load_system

SECONDS = 60
"""Far over what each takes (5 s at most), for tests may share a slow computer."""
KILOBYTES = 1_000_000
"""Of memory, at the most, for the process that runs all tests."""
NAMESPACE = 'xmlns="http://www.w3.org/2005/07/scxml" version="1.0"'
BOMB = "".join(
    f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' if n else '<!ENTITY e0 "aaaaaaaaaa">' for n in range(9)
)


def scxml(inside: str) -> bytes:
    return f'<scxml {NAMESPACE} datamodel="ecmascript">{inside}</scxml>'.encode()


def chart(head: str = "", state: str = "{}", more: str = "") -> bytes:
    return f"chart: T\n{head}\ninitial: a\nstates:\n  a: {state}\n{more}\n".encode()


def on(guard: str = "true", action: str = "x = 0") -> bytes:
    return chart(
        "data: {x: int32 = 0}\nevents: {in: [e]}",
        f"{{on: {{e: {{if: '{guard}', do: '{action}'}}}}}}",
    )


DEEP_XML = scxml("<state>" * 10_000 + "</state>" * 10_000)
DEEP_YAML = chart("", "\n" + "".join(" " * n + f"s{n}:\n" for n in range(4, 1_000)))
YAML_BOMB = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 30))

NESTED = "[2]" * 10_000

REFUSED: dict[str, tuple[str, bytes]] = {
    "entity bomb": (".scxml", f"<!DOCTYPE s [{BOMB}]><scxml>&e8;</scxml>".encode()),
    "external entity": (
        ".scxml",
        b'<!DOCTYPE s [<!ENTITY x SYSTEM "file:///etc/passwd">]><scxml>&x;</scxml>',
    ),
    "parameter entity": (
        ".scxml",
        b'<!DOCTYPE s [<!ENTITY % x SYSTEM "file:///etc/passwd"> %x;]><scxml><state/></scxml>',
    ),
    "xinclude": (
        ".scxml",
        scxml('<x:include xmlns:x="http://www.w3.org/2001/XInclude" href="/etc/passwd"/>'),
    ),
    "deep xml": (".scxml", DEEP_XML),
    "deep yaml": (".yaml", DEEP_YAML),
    "deep yaml in brackets": (".yaml", b"chart: " + b"[" * 10_000),
    "deep yaml in braces": (".yaml", b"chart: T\nstates: " + b"{a: " * 10_000),
    "deep yaml in dashes": (".yaml", b"chart: T\nstates:\n" + b"- " * 10_000 + b"a"),
    "deep yaml in keys": (".yaml", b"? " * 10_000),
    "parentheses": (".yaml", on("(" * 90_000 + "x" + ")" * 90_000)),
    "negations": (".yaml", on("!" * 190_000 + "true")),
    "conditionals": (".yaml", on("true ? true : " * 10_000 + "true")),
    "elements of elements": (".yaml", on("x[" * 50_000 + "0" + "]" * 50_000 + " == 1")),
    "calls of calls": (".yaml", on("min(1, " * 20_000 + "1" + ")" * 20_000 + " == 1")),
    "deep statements": (".yaml", on(action="if x == 0 { " * 10_000 + "x = 1" + " }" * 10_000)),
    "deep statements in xml": (
        ".scxml",
        scxml(
            "<state><onentry>" + '<if cond="1">' * 10_000 + "</if>" * 10_000 + "</onentry></state>"
        ),
    ),
    "arrays of arrays of arrays": (".yaml", chart(f"data: {{x: 'uint8{NESTED} = 0'}}")),
    "lists of lists": (
        ".yaml",
        chart("data: {x: 'uint8[3] = " + "[" * 9_000 + "1" + "]" * 9_000 + "'}"),
    ),
    "megabyte of guard": (".yaml", on("x == 0 and " * 90_000 + "true")),
    "megabyte of guard in xml": (
        ".scxml",
        scxml(f'<state><transition event="e" cond="{"1+" * 500_000}"/></state>'),
    ),
    "megabyte of statements": (".yaml", on(action="x = x + 1; " * 90_000)),
    "aliases": (".yaml", f"a0: &a0 [x]\n{YAML_BOMB}\n".encode()),
    "merge keys": (".yaml", b"chart: T\nbase: &b {a: 1}\nstates: {<<: *b}\n"),
    "utf-8 cut short": (".yaml", b"chart: T\xc3"),
    "utf-8 overlong": (".scxml", b"<scxml name='\xc0\xaf'/>"),
    "surrogates": (".yaml", b"chart: \xed\xa0\x80\n"),
    "utf-16 cut short": (".scxml", b"\xff\xfe<\x00s"),
    "encoding that is none": (".scxml", b'<?xml version="1.0" encoding="klingon"?><scxml/>'),
    "encoding that is a codec": (".scxml", b'<?xml version="1.0" encoding="zlib"?><scxml/>'),
    "encoding that is undefined": (
        ".scxml",
        b'<?xml version="1.0" encoding="undefined"?><scxml/>',
    ),
    "encoding that is not so": (".scxml", b'<?xml version="1.0" encoding="utf-16"?><scxml/>'),
    "null in a name": (".yaml", b"chart: T\nstates: {a\0b: {}}\n"),
    "null escaped in a name": (".yaml", b'chart: T\ninitial: x\nstates: {"a\\0b": {}}\n'),
    "null in xml": (".scxml", b"<scxml name='a\0b'/>"),
    "nothing": (".yaml", b""),
    "nothing in xml": (".scxml", b""),
    "huge integer": (".yaml", on(f"x == 1{'0' * 400}")),
    "huge start value": (".yaml", chart(f"data: {{x: int32 = 1{'0' * 5_000}}}")),
    "huge range": (".yaml", chart(f"data: {{x: 0..1{'0' * 400} = 0}}")),
    "range beyond 64 bits": (".yaml", chart("data: {x: 0..18446744073709551616 = 0}")),
    "huge float": (".yaml", on("x == 1e999")),
    "start value beyond its type": (".yaml", chart("data: {x: uint8 = 300}")),
    "huge microsteps": (".yaml", chart("capacity: {microsteps: 99999999999}")),
    "division by zero": (".yaml", on("1 % 0 == x")),
    "negative delay": (".yaml", chart("", "{after: {-1s: a}}")),
    "no tick": (".yaml", chart("capacity: {tick: 0s}")),
    "huge array": (".yaml", chart('data: {x: "uint8[1000000000] = 0"}')),
    "huger array": (".yaml", chart(f'data: {{x: "uint8[1{"0" * 400}] = 0"}}')),
    "array of arrays": (".yaml", chart('data: {x: "uint8[60000][60000] = 0"}')),
    "huge capacity": (".yaml", chart("capacity: {queue: 1000000000}")),
    "huger capacity": (".yaml", chart(f"capacity: {{queue: 1{'0' * 5_000}}}")),
    "negative capacity": (".yaml", chart("capacity: {queue: -1}")),
    "huge delay": (".yaml", chart("", "{after: {99999999999999999999h: a}}")),
    "delay of years": (".yaml", chart("", "{after: {87600h: a}}")),
    "huge delay in xml": (
        ".scxml",
        scxml('<state><onentry><send event="e" delay="x"/></onentry></state>').replace(
            b'"x"', b'"' + b"9" * 5_000 + b's"'
        ),
    ),
    "unknown targets": (
        ".yaml",
        chart("events: {in: [e]}", "{on: {e: [" + ", ".join(f"t{n}" for n in range(2_000)) + "]}}"),
    ),
    "long name not known": (".yaml", chart("", f"{{always: {'x' * 1_000_000}}}")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_with_a_place(name: str, tmp_path: Path) -> None:
    suffix, content = REFUSED[name]
    path = tmp_path / f"hostile{suffix}"
    path.write_bytes(content)
    findings = ended(lambda: refused(path))
    for found in findings:
        assert found.primary is not None, found.message[:200]
        span = found.primary.span
        assert 0 <= span.start <= span.end <= len(span.source.text) + 1
        assert "passwd" not in found.message
    assert findings.has_errors


def refused(path: Path) -> Findings:
    findings = Findings()
    with pytest.raises(FsmkitError) as told:
        load_with_findings(path, findings, strict=True)
    findings.extend(told.value.diagnostics)
    assert str(told.value)
    return findings


def _peak() -> int:
    """Return the most memory that the process had: other tests may have had more than these."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def ended(work: Callable[[], Findings]) -> Findings:
    """Do it, within bounds of time and memory."""
    started, before = time.process_time(), _peak()
    result = work()
    assert _peak() - before < KILOBYTES
    assert time.process_time() - started < SECONDS
    return result


def test_a_chart_that_extends_itself(tmp_path: Path) -> None:
    for one, other in (("a", "b"), ("b", "c"), ("c", "a")):
        (tmp_path / f"{one}.yaml").write_text(f"chart: T\nextends: {other}.yaml\n")
    assert any("extends itself" in d.message for d in refused(tmp_path / "a.yaml"))


@pytest.mark.parametrize(
    "base",
    [
        "t.yaml",
        "loop.yaml",
        "folder.yaml",
        "none.yaml",
        '"a\\0b.yaml"',
        "/etc/passwd",
        '""',
        "a" * 999,
    ],
)
def test_a_base_that_is_none(base: str, tmp_path: Path) -> None:
    (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
    (tmp_path / "folder.yaml").mkdir()
    path = tmp_path / "t.yaml"
    path.write_text(f"chart: T\nextends: {base}\n")
    found = refused(path)
    assert len(found) == (2 if "\\0" in base else 1)  # the character, and that no name is left
    assert all(one.primary is not None for one in found)


@pytest.mark.slow
def test_a_thousand_bases(tmp_path: Path) -> None:
    (tmp_path / "c0.yaml").write_bytes(chart())
    for number in range(1, 1_000):
        path = tmp_path / f"c{number}.yaml"
        path.write_text(f"chart: T{number}\nextends: c{number - 1}.yaml\n")
    findings = Findings()
    ended(lambda: (load_with_findings(path, findings), findings)[1])
    assert not findings.has_errors


SECRET = "of-another-folder"


@pytest.mark.parametrize(
    "src",
    ["../secret", "file:../secret", "link", "loop", "pipe", ".", "/dev/zero", "http://localhost:1/x",
     "a\u2028b", "x" * 9_999],
)  # fmt: skip
@pytest.mark.parametrize(
    "inside",
    [
        '<datamodel><data id="x" src="{}"/></datamodel><state/>',
        '<script src="{}"/><state/>',
    ],
)
def test_no_source_leads_out_of_the_folder(src: str, inside: str, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text(f'"{SECRET}"')
    folder = tmp_path / "chart"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "loop").symlink_to(folder / "loop")
    mkfifo(folder / "pipe")
    path = folder / "t.scxml"
    path.write_bytes(scxml(inside.replace("{}", src)))
    findings = Findings()
    try:
        read = str(load_with_findings(path, findings))
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        read = str(error)
    assert "unloaded-source" in {found.rule.name for found in findings}
    assert SECRET not in read
    assert SECRET not in "".join(found.message for found in findings)


def test_a_script_that_is_the_chart_itself(tmp_path: Path) -> None:
    path = tmp_path / "t.scxml"
    path.write_bytes(scxml('<script src="t.scxml"/><state/>'))
    assert refused(path).has_errors


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig"])
def test_what_xml_is_encoded_in(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "wide.scxml"
    path.write_bytes(scxml('<state id="ä"/>').decode().encode(encoding))
    assert load_with_findings(path, Findings()).states[1].id == "ä"


def test_utf_16_is_read(tmp_path: Path) -> None:
    path = tmp_path / "wide.yaml"
    path.write_bytes(chart().decode().encode("utf-16"))
    assert load_with_findings(path, Findings()).states[1].id == "a"


@pytest.mark.slow
@pytest.mark.parametrize(
    "content",
    [
        chart("events: {in: [" + ", ".join(f"e{n}" for n in range(2_000)) + "]}"),
        chart(
            "data: {x: int32 = 0}\nevents: {in: [e]}",
            "\n    on:\n      e:\n"
            + "".join(f"      - {{if: x == {n}, target: a}}\n" for n in range(1_000)),
        ),
        chart("", "{after: {500h: a}}"),
    ],
    ids=["events", "transitions", "weeks"],
)
def test_what_is_large_but_right_is_read(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_bytes(content)

    def read() -> Findings:
        findings = Findings()
        load_with_findings(path, findings)
        return findings

    assert not ended(read).has_errors


@pytest.mark.parametrize("event", ["error.own", "done.own"])
def test_an_error_of_ones_own_with_an_id_is_sent(event: str, tmp_path: Path) -> None:
    """Found by fuzzing: what is known of it was forgotten twice."""
    path = tmp_path / "own.scxml"
    path.write_bytes(
        scxml(
            f'<state><onentry><send event="{event}" id="i"/></onentry>'
            f'<transition event="{event}" cond="_event.sendid" target="b"/></state>'
            '<state id="b"/>'
        )
    )
    chart = load_with_findings(path, Findings())
    assert event in chart.event_index


def test_a_system_of_a_thousand_machines(tmp_path: Path) -> None:
    (tmp_path / "one.yaml").write_bytes(chart())
    path = tmp_path / "many.yaml"
    machines = "".join(f"  m{n}: one.yaml\n" for n in range(1_000))
    path.write_text(f"system: S\nmachines:\n{machines}properties:\n  D: deadlock_free\n")

    def read() -> Findings:
        findings = Findings()
        try:
            load_system(path, findings)
        except FsmkitError as error:
            findings.extend(error.diagnostics)
        return findings

    ended(read)
