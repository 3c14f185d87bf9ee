"""Files of requirements: each format, and what is wrong with broken, huge and hostile ones."""

from __future__ import annotations

import json
import struct
import zipfile
from io import BytesIO
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.testing.requirements import csv_table
from fsmkit.testing.requirements.reading import chosen_requirements, read_file, read_requirements
from fsmkit.testing.requirements.requirement import Requirement

ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines" / "production_cell" / "requirements"


def contents(found: tuple[Requirement, ...]) -> list[tuple[str, str]]:
    return [(str(one.id), str(one.text)) for one in found]


def test_the_requirements_of_the_cell_are_equal_in_three_formats() -> None:
    files = [read_file(CELL / name) for name in ("cell.csv", "cell.reqif", "needs.json")]
    table, reqif, needs = map(contents, files)
    assert table == reqif == needs
    assert len(table) == 9
    levels = [[dict(one.columns)["integrity"] for one in found] for found in files]
    assert levels[0] == levels[1] == levels[2]
    for found, name in zip(files, ("cell.csv", "cell.reqif", "needs.json"), strict=True):
        lines = (CELL / name).read_text().splitlines()
        for one in found:
            start, _ = one.span.source.position(one.span.start)
            near = "\n".join(lines[start - 1 : start + 4])
            assert one.id in near, (name, one.id)


@pytest.mark.parametrize(
    "text",
    [
        'id,text\nA-1,one\nA-2,"two,\n three"\n',
        'ID;Text\r\nA-1;one\r\nA-2;"two,\r\n three"\r\n',
        '\ufeffid\ttext\nA-1\tone\n\nA-2\t"two,\n three"\n',
        'status|text|id\nopen|one|A-1\nopen|"two,  three"|A-2\n',
        'id,title,description\nA-1,t,one\nA-2,t,"two, three"\n',
    ],
)
def test_tables_with_any_delimiter(tmp_path: Path, text: str) -> None:
    file = tmp_path / "r.csv"
    file.write_text(text, encoding="utf-8", newline="")
    assert contents(read_file(file)) == [("A-1", "one"), ("A-2", "two, three")]


def test_a_table_in_utf_16(tmp_path: Path) -> None:
    file = tmp_path / "r.csv"
    file.write_text("id,text\nA-1,größer\n", encoding="utf-16")
    assert contents(read_file(file)) == [("A-1", "größer")]


def test_an_archive_of_reqif(tmp_path: Path) -> None:
    file = tmp_path / "cell.reqifz"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(CELL / "cell.reqif", "cell.reqif")
        archive.writestr("files/picture.png", b"x" * 1000)
    assert contents(read_file(file)) == contents(read_file(CELL / "cell.csv"))


def test_a_folder_of_doorstop(tmp_path: Path) -> None:
    inner = tmp_path / "req" / "sub"
    inner.mkdir(parents=True)
    for folder, prefix in ((inner.parent, "REQ"), (inner, "SUB")):
        (folder / ".doorstop.yml").write_text(f"settings:\n  digits: 3\n  prefix: {prefix}\n")
    item = (
        "active: {active}\nderived: false\nlevel: 1.0\nnormative: {normative}\ntext: |\n  {text}\n"
    )
    for path, active, normative, text in (
        (inner.parent / "REQ001.yml", "true", "true", "one"),
        (inner.parent / "REQ002.yml", "false", "true", "two"),
        (inner.parent / "REQ003.yml", "true", "false", "a heading"),
        (inner / "SUB001.yml", "true", "true", "four"),
        (inner / "other.yml", "true", "true", "no item"),
    ):
        path.write_text(item.format(active=active, normative=normative, text=text))
    assert contents(read_file(tmp_path)) == [("REQ001", "one"), ("SUB001", "four")]
    (inner / "SUB002.yml").write_text("text: [\n")
    with pytest.raises(FsmkitError, match=r"SUB002\.yml"):
        read_file(tmp_path)
    (inner / ".doorstop.yml").write_text("settings:\n  itemformat: asciidoc\n  prefix: SUB\n")
    message = r"format `asciidoc` are not read(.|\n)*doorstop\.yml:2:15"
    with pytest.raises(FsmkitError, match=message):
        read_file(tmp_path)


MARKDOWN = "settings:\n  itemformat: markdown\n  prefix: REQ\n"
KEYS = "active: true\nderived: false\nlevel: 1.0\nlinks: []\nnormative: true\nreviewed: null\n"


@pytest.mark.parametrize(
    ("item", "text"),
    [
        (f"---\n{KEYS}---\n\nThe gate is\nshut.\n", "The gate is shut."),
        (f"---\n{KEYS}---\n# Gate\n\nIt is shut.\n", "It is shut."),
        (f"---\n{KEYS}---\n\n\n# Only a heading\n", "Only a heading"),
        (f"---\n{KEYS}text: old\n---\nnew\n", "new"),
        (f"---\n{KEYS}---\nIt is\n# no header\n---\nshut\n", "It is # no header --- shut"),
        (f"---\r\n{KEYS}---  \r\n\r\nlines of Windows\r\n", "lines of Windows"),
        (f"----\n{KEYS}----\n", ""),
        (f"---\n{KEYS.replace('normative: true', 'normative: false')}---\nchapter\n", None),
        (f"---\n{KEYS.replace('active: true', 'active: false')}---\ngone\n", None),
    ],
)
def test_items_of_doorstop_in_markdown(tmp_path: Path, item: str, text: str | None) -> None:
    (tmp_path / ".doorstop.yml").write_text(MARKDOWN)
    (tmp_path / "REQ001.md").write_bytes(item.encode())
    (tmp_path / "README.md").write_text("no item")
    (tmp_path / "REQ002.yml").write_text("text: of another format\n")
    assert contents(read_file(tmp_path)) == ([] if text is None else [("REQ001", text)])


@pytest.mark.parametrize(
    ("item", "message"),
    [
        (b"text without keys\n", "no front matter"),
        (b"---\nactive: true\n", "no front matter"),
        (b"", "no front matter"),
        (b"---\n---\ntext\n", "is empty"),
        (b"---\nactive: true\nlevel: [\n---\n", r"REQ001\.md:[34]:"),
        (b"---\nactive: true\nlinks: *a\n---\n", r"REQ001\.md:3:"),
        (b"---\nactive: true\xff\n---\n", "UTF-8"),
        (b"---\n- a\n---\n", "no keys"),
    ],
)
def test_broken_items_in_markdown_have_a_location(
    tmp_path: Path, item: bytes, message: str
) -> None:
    (tmp_path / ".doorstop.yml").write_text(MARKDOWN)
    (tmp_path / "REQ001.md").write_bytes(item)
    with pytest.raises(FsmkitError, match=message):
        read_file(tmp_path)


def reqif(objects: str, head: str = "") -> str:
    return (
        f'<?xml version="1.0"?>{head}<REQ-IF xmlns="http://www.omg.org/spec/ReqIF/20110401/reqif.xsd">'
        "<CORE-CONTENT><REQ-IF-CONTENT><SPEC-TYPES><SPEC-OBJECT-TYPE><SPEC-ATTRIBUTES>"
        '<ATTRIBUTE-DEFINITION-XHTML IDENTIFIER="t" LONG-NAME="ReqIF.Text"/>'
        '<ATTRIBUTE-DEFINITION-STRING IDENTIFIER="c" LONG-NAME="ReqIF.ChapterName"/>'
        "</SPEC-ATTRIBUTES></SPEC-OBJECT-TYPE></SPEC-TYPES>"
        f"<SPEC-OBJECTS>{objects}</SPEC-OBJECTS></REQ-IF-CONTENT></CORE-CONTENT></REQ-IF>"
    )


def test_text_of_xhtml_and_chapters(tmp_path: Path) -> None:
    value = (
        "<VALUES><ATTRIBUTE-VALUE-XHTML><DEFINITION><ATTRIBUTE-DEFINITION-XHTML-REF>t"
        "</ATTRIBUTE-DEFINITION-XHTML-REF></DEFINITION><THE-VALUE><div>If <b>x &lt; 1</b>,"
        "<br/>stop<!-- a > b --><![CDATA[ <now> ]]></div></THE-VALUE>"
        "</ATTRIBUTE-VALUE-XHTML></VALUES>"
    )
    chapter = (
        '<VALUES><ATTRIBUTE-VALUE-STRING THE-VALUE="1 Safety"><DEFINITION>'
        "<ATTRIBUTE-DEFINITION-STRING-REF>c</ATTRIBUTE-DEFINITION-STRING-REF></DEFINITION>"
        "</ATTRIBUTE-VALUE-STRING></VALUES>"
    )
    file = tmp_path / "r.xml"
    file.write_text(reqif(
        f'<SPEC-OBJECT IDENTIFIER="R-1">{value}</SPEC-OBJECT>'
        f'<SPEC-OBJECT IDENTIFIER="R-2">{chapter}</SPEC-OBJECT>'
        '<SPEC-OBJECT IDENTIFIER="R-3" LONG-NAME="named"/>'
    ))  # fmt: skip
    assert contents(read_file(file)) == [("R-1", "If x < 1 , stop <now>"), ("R-3", "named")]


def zipped(members: dict[str, bytes]) -> bytes:
    found = BytesIO()
    with zipfile.ZipFile(found, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return found.getvalue()


def lying_bomb() -> bytes:
    """Return an archive whose directory claims ten bytes for 65 MiB."""
    size = 65 << 20
    content = bytearray(zipped({"bomb.reqif": b" " * size}))
    at = content.find(struct.pack("<I", size))
    while at >= 0:
        content[at : at + 4] = struct.pack("<I", 10)
        at = content.find(struct.pack("<I", size))
    return bytes(content)


def encrypted() -> bytes:
    content = bytearray(zipped({"a.reqif": b"<REQ-IF/>"}))
    content[6] |= 1
    content[content.find(b"PK\x01\x02") + 8] |= 1
    return bytes(content)


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'
NEEDS = {"current_version": "1", "versions": {"1": {"needs": {"R-1": {"id": "R-1"}}}}}
BROKEN = {
    "no id": b"name,text\na,b\n",
    "empty": b"",
    "blank": b"\n \n",
    "no id in a row": b"id,text\n,b\n",
    "too many cells": b"id,text\na,b,c\n",
    "open quote": b'id,text\na,"b\n',
    "stray quote": b'id,text\na,"b"c\n',
    "long cell": b"id,text\na," + b"x" * 200_000 + b"\n",
    "not UTF-8": b"id,text\na,\xff\xfe\xfa\n",
    "many rows": b"id\n" + b"r\n" * 1001,
    "entities": reqif("&b;", BOMB).encode(),
    "external entity": reqif("&b;", '<!DOCTYPE x [<!ENTITY b SYSTEM "file:///etc/passwd">]>').encode(),
    "external subset": reqif("", '<!DOCTYPE x SYSTEM "http://example.org/x.dtd">').encode(),
    "unknown entity": reqif("&b;").encode(),
    "inclusion": reqif('<i:include xmlns:i="http://www.w3.org/2001/XInclude" href="x"/>').encode(),
    "deep": b"<a>" * 10_000 + b"</a>" * 10_000,
    "open tag": reqif("<SPEC-OBJECT>").encode(),
    "no identifier": reqif("<SPEC-OBJECT/>").encode(),
    "no ReqIF": b"<html/>",
    "unknown encoding": b'<?xml version="1.0" encoding="klingon"?><REQ-IF/>',
    "no zip": b"PK\x03\x04 nothing",
    "zip without reqif": zipped({"a.txt": b"x"}),
    "zip with many files": zipped({f"{n}.reqif": b"" for n in range(1001)}),
    "zip bomb": zipped({"bomb.reqif": b" " * (65 << 20)}),
    "zip bomb in parts": zipped({f"{n}.reqif": reqif(" " * (17 << 20)).encode() for n in range(4)}),
    "lying zip bomb": lying_bomb(),
    "encrypted zip": encrypted(),
    "broken reqif in zip": zipped({"a.reqif": b"<REQ-IF>"}),
    "cut zip": zipped({"a.reqif": reqif("").encode()})[:-30],
    "half JSON": json.dumps(NEEDS).encode()[:-3],
    "deep JSON": b"{" + b'"a":[' * 100_000,
    "JSON without versions": b'{"a": 1}',
    "JSON list": b"[1]",
    "unknown version": json.dumps({**NEEDS, "versions": {"2": {}, "3": {}}}).encode(),
    "version without needs": json.dumps({**NEEDS, "versions": {"1": {"needs": []}}}).encode(),
    "need that is text": json.dumps({"versions": {"1": {"needs": {"R": "x"}}}}).encode(),
    "need with number": json.dumps({"versions": {"1": {"needs": {"R": {"id": 1}}}}}).encode(),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_a_finding_with_its_location(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(csv_table, "MOST", 1000)
    file = tmp_path / "r"
    file.write_bytes(BROKEN[name])
    with pytest.raises(FsmkitError) as raised:
        read_file(file)
    for one in raised.value.diagnostics:
        assert one.rule.name == "broken-requirements"
        assert one.primary is not None
        assert str(file) in one.primary.span.source.name
        assert one.help
        assert len(str(raised.value)) < 20_000


def test_an_empty_folder_is_a_finding(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError, match="no document of Doorstop"):
        read_file(tmp_path)
    with pytest.raises(FsmkitError, match="cannot read"):
        read_file(tmp_path / "missing.csv")


def test_an_id_twice_is_a_finding_unless_other_files_agree(tmp_path: Path) -> None:
    one, two = tmp_path / "a.csv", tmp_path / "b.csv"
    one.write_text("id,text\nA,x\nB,y\n")
    two.write_text("id,text\nA,x\n")
    findings = Findings()
    assert list(read_requirements([one, two], findings)) == ["A", "B"]
    assert not list(findings)
    two.write_text("id,text\nA,other\nB,y\nB,y\n")
    read_requirements([one, two], findings)
    assert [found.rule.name for found in findings] == ["duplicate-requirement"]
    findings = Findings()
    read_requirements([two], findings)
    assert [found.message for found in findings] == ["the requirement `B` is listed twice"]


def test_columns_choose_requirements() -> None:
    every = read_requirements([CELL / "cell.csv"], Findings())
    assert len(chosen_requirements(every, [("Integrity", "sil 2")])) == 3
    with pytest.raises(FsmkitError, match="use one of integrity"):
        chosen_requirements(every, [("level", "1")])


def test_locations_are_found_among_many_needs(tmp_path: Path) -> None:
    needs = {f"R-{n}": {"id": f"R-{n}", "content": "x" * 20} for n in range(5000)}
    file = tmp_path / "needs.json"
    file.write_text(json.dumps({"current_version": "1", "versions": {"1": {"needs": needs}}}))
    found = read_file(file)
    assert len(found) == 5000
    last = found[-1].span
    assert last.source.text[last.start : last.end] == '"R-4999"'
