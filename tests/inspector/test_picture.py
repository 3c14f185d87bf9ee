"""Pictures of plants: what they bind is read, what they must not hold does not reach a page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.picture import (
    DRAWN,
    ELEMENTS,
    MOST_BYTES,
    Picture,
    check_names,
    picture_of,
    read_picture,
)
from fsmkit.system.of_one_chart import system_of
from tests.inspector.conftest import Client

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
CELL = Path(__file__).parents[2] / "machines/production_cell/live/cell.svg"


def made(body: str, head: str = HEAD) -> tuple[Picture, list[str]]:
    """Return the picture of a body, and what was said of it."""
    findings = Findings()
    picture = picture_of(f"{head}{body}</svg>".encode(), "p.svg", findings)
    return picture, [finding.message for finding in findings]


def refusal(body: str, head: str = HEAD) -> str:
    """Return why a picture is refused."""
    with pytest.raises(FsmkitError) as error:
        made(body, head)
    assert error.value.diagnostics[0].rule.name == "wrong-view"
    return error.value.diagnostics[0].message


def test_an_element_is_bound() -> None:
    picture, said = made(
        '<g data-x="arm.position 0..1000 0..140" data-class="lit: lamp; bad: verdict = 2"'
        ' data-rotate="arm.angle -5..5 0..90 50 50" data-show="gate != closed">'
        '<text data-text="count" data-digits="1" data-words="a|b" data-label="Blocks">0</text></g>'
        '<rect data-post="gate.open" data-with="n=3 on=true kind=jam" data-group="Buttons"/>'
    )
    assert said == []
    assert picture.items == (
        {
            "id": "v0",
            "x": {"of": "arm.position", "in": [0, 1000], "out": [0, 140], "about": []},
            "class": [
                {"word": "lit", "of": "lamp", "is": "", "value": ""},
                {"word": "bad", "of": "verdict", "is": "=", "value": "2"},
            ],
            "rotate": {"of": "arm.angle", "in": [-5, 5], "out": [0, 90], "about": [50, 50]},
            "show": {"of": "gate", "is": "!=", "value": "closed"},
        },
        {"id": "v1", "text": "count", "digits": 1, "words": ["a", "b"], "label": "Blocks"},
        {
            "id": "v2",
            "post": {"m": "gate", "event": "open"},
            "with": {"n": 3, "on": True, "kind": "jam"},
            "group": "Buttons",
        },
    )
    assert re.findall(r'id="(\w+)"', picture.svg) == ["v0", "v1", "v2"]
    assert "data-" not in picture.svg


HOSTILE = {
    "<script>alert(1)</script>": "the element `script`",
    '<g onclick="alert(1)"/>': "the attribute `onclick`",
    "<foreignObject><body xmlns='http://www.w3.org/1999/xhtml'/></foreignObject>": (
        "the element `foreignObject`"
    ),
    '<a href="javascript:alert(1)"><rect/></a>': "the element `a`",
    '<rect href="javascript:alert(1)"/>': "the attribute `href`",
    '<rect xmlns:xlink="http://www.w3.org/1999/xlink" xlink:href="http://x"/>': "xlink}href",
    '<use href="#a"/>': "the element `use`",
    '<image href="http://x/y.png"/>': "the element `image`",
    "<style>*{background:url(http://x)}</style>": "the element `style`",
    '<rect fill="url(http://x)"/>': "the attribute `fill`",
    '<rect style="fill: UrL(http://x); stroke: #fff"/>': "the attribute `fill`",
    '<rect fill="\\75 rl(http://x)"/>': "the attribute `fill`",
    '<animate attributeName="x" values="1;2"/>': "the element `animate`",
    '<set attributeName="onclick" to="alert(1)"/>': "the element `set`",
    '<rect filter="x"/>': "the attribute `filter`",
    '<h:img xmlns:h="http://www.w3.org/1999/xhtml" src="x"/>': "the element `img`",
}


@pytest.mark.parametrize(("body", "told"), HOSTILE.items())
def test_what_must_not_reach_a_page_is_left_out(body: str, told: str) -> None:
    picture, said = made(f"<g>{body}</g>")
    assert len(said) == 1
    assert told in said[0]
    assert set(re.findall(r"<(\w+)", picture.svg)) <= ELEMENTS
    assert set(re.findall(r" ([\w:]+)=", picture.svg)) <= DRAWN | {"xmlns", "id"}
    assert "http://x" not in picture.svg
    assert "alert" not in picture.svg.replace("alert(1)</g>", "")


def test_text_stays_text() -> None:
    picture, _ = made("<text>&lt;script&gt;\u202e ]]&gt; <b/>tail</text>")
    assert "<text>&lt;script&gt;\u202e ]]&gt; tail</text>" in picture.svg


def test_entities_are_refused() -> None:
    bomb = '<!DOCTYPE svg [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>' + HEAD
    assert "document type" in refusal("<text>&b;</text>", bomb)
    file = '<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/passwd">]>' + HEAD
    assert "document type" in refusal("<text>&a;</text>", file)
    assert "not XML" in refusal("<text>&b;</text>")


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("<g>" * 100 + "</g>" * 100, "within each other"),
        ("<g/>" * 10_001, "more than 10,000 elements"),
        ('<g data-text="a"/>' * 1_001, "more than 1,000"),
        (f'<path d="{"M" * 20_001}"/>', "20,001 characters"),
        ('<g data-x="a 0..0 0..1"/>', "`data-x` is not of the form"),
        ('<g data-x="a 0..1"/>', "`data-x`"),
        ('<g data-text="a b"/>', "`data-text` is no name"),
        ('<g data-show="a ~ b"/>', "`data-show`"),
        ('<g data-class="a b"/>', "`data-class`"),
        ('<g data-post="open"/>', "`data-post`"),
        ('<g data-with="a=1"/>', "`data-with` needs `data-post`"),
        ('<g data-text="a" data-digits="9"/>', "`data-digits` is no number"),
        ("<g><rect></g>", "is not XML"),
    ],
)
def test_what_cannot_be_read_is_refused(body: str, why: str) -> None:
    assert why in refusal(body)


def test_a_file_that_is_no_picture_is_refused(tmp_path: Path) -> None:
    assert "not SVG" in refusal("", '<svg viewBox="0 0 1 1">')
    assert "no `viewBox`" in refusal("", '<svg xmlns="http://www.w3.org/2000/svg">')
    large = tmp_path / "large.svg"
    large.write_bytes(HEAD.encode() + b" " * 10_000_000 + b"</svg>")
    with pytest.raises(FsmkitError, match=f"more than {MOST_BYTES:,} bytes"):
        read_picture(large, Findings())
    with pytest.raises(FsmkitError, match="No such file"):
        read_picture(tmp_path / "none.svg", Findings())
    binary = tmp_path / "binary.svg"
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(FsmkitError, match="is not XML"):
        read_picture(binary, Findings())


def test_names_of_machines_and_events_are_checked(gate: Path) -> None:
    system = system_of(fsmkit.read_chart(gate))
    check_names(made('<g data-post="Gate.open" data-machine="Gate"/>')[0], system)
    for body, name in (('<g data-post="Gate.opn"/>', "opn"), ('<g data-machine="Gat"/>', "Gat")):
        with pytest.raises(FsmkitError, match=f"`{name}`, which there is not"):
            check_names(made(body)[0], system)


def test_a_hub_tells_its_picture(gate: Path) -> None:
    chart = fsmkit.read_chart(gate)
    assert Client(Hub(chart)).result("picture") is None
    picture, _ = made('<text data-text="Gate.count"/>')
    assert Client(Hub(chart, picture=picture)).result("picture") == json.loads(
        json.dumps(picture.as_json())
    )


def test_serve_refuses_a_picture_that_is_none(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "p.svg"
    picture.write_text(f'{HEAD}<g data-post="Gate.opn"/></svg>', encoding="utf-8")
    assert execute(["serve", str(gate), "--view", str(picture)]) == 1
    assert "did you mean" in capsys.readouterr().err


def test_the_picture_of_the_cell_is_whole() -> None:
    findings = Findings()
    picture = read_picture(CELL, findings)
    assert list(findings) == []
    assert len(picture.items) > 60
