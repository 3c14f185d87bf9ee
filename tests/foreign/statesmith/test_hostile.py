"""Damaged and hostile diagrams: read, or rejected with a location, in bounded time and memory."""

from __future__ import annotations

import base64
import random
import zlib

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.foreign.notation import ForeignNotation
from fsmkit.plugins import plugin
from fsmkit.yaml.writer import write_document
from tests.foreign.imports import imported, messages
from tests.foreign.statesmith.diagrams import drawio
from tests.foreign.statesmith.test_reading import NOTATIONS

DAMAGED = 30
"""Variants of each file; `python -m devtools.foreign` tries more."""


def damaged(content: bytes, chosen: random.Random) -> bytes:
    """Return content that is cut, or in which some bits are flipped."""
    if chosen.random() < 0.4:
        return content[: chosen.randrange(len(content))]
    changed = bytearray(content)
    for _ in range(chosen.randrange(1, 9)):
        changed[chosen.randrange(len(changed))] ^= 1 << chosen.randrange(8)
    return bytes(changed)


def read_whole(content: bytes, name: str) -> None:
    """Read every machine of a file; the chart is written where there is one."""
    notation = plugin(ForeignNotation, "statesmith")
    findings = Findings()
    source = notation.decode(content, name, findings)
    for machine in () if source is None else notation.machines(source, findings):
        assert source is not None
        found = notation.import_machine(source, machine, findings)
        if found is not None and not findings.has_errors:
            write_document(found.document)
    assert all(one.primary is not None for one in findings)


@pytest.mark.parametrize("name", NOTATIONS)
def test_damaged_files(name: str) -> None:
    chosen = random.Random(name)
    for _ in range(DAMAGED):
        read_whole(damaged(NOTATIONS[name].encode(), chosen), name)


def test_a_compressed_bomb() -> None:
    deflater = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = b"".join(deflater.compress(b"<" * 1_000_000) for _ in range(60)) + deflater.flush()
    page = f"<diagram>{base64.b64encode(data).decode()}</diagram>"
    for text in (f"<mxfile>{page}</mxfile>", f"<mxfile>{page * 5}</mxfile>"):
        _, findings = imported("statesmith", text, "bomb.drawio")
        assert any(one.startswith("the page is neither") for one in messages(findings))


ENTITIES = '<!DOCTYPE mxfile [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><mxfile>&b;</mxfile>'
EXTERNAL = '<!DOCTYPE mxfile [<!ENTITY x SYSTEM "file:///etc/passwd">]><mxfile>&x;</mxfile>'
CIRCLE = (
    "<mxfile><diagram><mxGraphModel><root>"
    '<mxCell id="a" parent="b" vertex="1" value="A"/><mxCell id="b" parent="a" vertex="1"/>'
    '<mxCell id="c" parent="c" vertex="1" value="$STATEMACHINE : M"/>'
    "</root></mxGraphModel></diagram></mxfile>"
)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (ENTITIES, "m.drawio"),
        (EXTERNAL, "m.drawio"),
        (EXTERNAL, "m.graphml"),
        (CIRCLE, "m.drawio"),
        ("<mxfile><diagram>AAAA</diagram></mxfile>", "m.drawio"),
        ("<svg/>", "m.drawio.svg"),
        ('<svg content="&lt;mxfile"/>', "m.drawio.svg"),
        ("", "m.puml"),
        ("@startuml", "m.puml"),
        ("@startuml M\n" + "state A {\n" * 500, "m.puml"),
        ("@startuml M\n[*] --> A\nA " + "-" * 100_000, "m.puml"),
        ("@startuml M\n[*] --> A\n" + "/'" * 50_000, "m.puml"),
        ("@startuml M\n[*] --> A\nA : " + "/*" * 50_000, "m.puml"),
        ("@startuml M\n[*] --> A\nA : E [" + "(" * 50_000 + "]", "m.puml"),
        ("@startuml M\n[*] --> A\n" + "A --> B : E\n" * 5_000, "m.puml"),
        ("x" * (1 << 22), "m.puml"),
    ],
)
def test_hostile_files(text: str, name: str) -> None:
    _, findings = imported("statesmith", text, name)
    assert all(one.primary is not None for one in findings)


def test_deeply_nested_cells() -> None:
    cells = "".join(
        f'<mxCell id="{n}" parent="{n - 1}" vertex="1" value="S{n}"/>' for n in range(2, 3_000)
    )
    text = drawio("M", (("i", "$initial_state", ()),), ()).replace("</root>", f"{cells}</root>")
    read_whole(text.encode(), "deep.drawio")


@pytest.mark.parametrize(
    "name",
    ["if", "send", "State", "a.b", "Tür", "x\ny", "*/ int x; /*", "{}", "'", '"', "$", "1", "a: b"],
)
def test_hostile_names(name: str) -> None:
    shapes = (("i", "$initial_state", ()), ("a", f"{name}\n{name} / {name};", ()), ("b", "B", ()))
    read_whole(drawio(name, shapes, (("i", "b", ""), ("a", "b", name))).encode(), "names.drawio")
