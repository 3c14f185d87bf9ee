"""``show``: what it says is the chart; ``--origin`` says where each item comes from."""

from __future__ import annotations

import json
import random
from pathlib import Path
from textwrap import dedent

import pytest
from rich.text import Text
from rich.tree import Tree

from fsmkit.chart.loading import elaborated
from fsmkit.chart.views.chart_tree import chart_tree
from fsmkit.chart.views.origins import origins
from fsmkit.cli import execute
from fsmkit.cli.common.console import unwrapped
from fsmkit.cli.looking.show import tree_lines
from fsmkit.diagnostics import Findings
from fsmkit.plan.lower import lower
from fsmkit.plan.tree import plan_tree
from fsmkit.system.any_file import read_sources

BASE = """
    chart: Base
    types: {Fault: [none, jam]}
    constants: {LIMIT: 3, T: 2s}
    data: {n: "0..9 = LIMIT"}
    operations: ["go(speed 0..100) -> bool"]
    events: {in: [start, "fault(code Fault)"], out: [done]}
    initial: idle
    states:
      idle:
        rest: true
        invariant: n < 9
        entry: n = 0
        on: {start: {id: begin, target: busy}}
      busy:
        on: {fault: {if: event.code == Fault.jam, target: idle, do: send done}}
        after: {T: {target: idle, watchdog: true}}
      main:
        regions:
          left: {states: {l: {}}}
          right: {initial: r, states: {r: {}, back: {history: deep, default: r}}}
"""
DERIVED = """
    chart: Derived
    extends: base.yaml
    doc: The one that runs.
    constants: {LIMIT: 4}
    outputs: {power: 0..5 = 1}
    capacity: {queue: 3}
    refine:
      idle:
        entry: super; n = 1
        on: {start: {override: begin, do: n += 2}}
      busy:
        always: {if: go(5), target: main}
        on: {start: {}}
"""


@pytest.fixture
def chart(tmp_path: Path) -> Path:
    (tmp_path / "base.yaml").write_text(dedent(BASE))
    path = tmp_path / "derived.yaml"
    path.write_text(dedent(DERIVED))
    return path


def show(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert execute(["show", *map(str, arguments)]) == 0
    return capsys.readouterr().out


def test_the_chart_as_understood(chart: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = show(capsys, chart)
    for line in (
        "Derived  extends Base",
        "The one that runs.",
        "Fault: none, jam",
        "LIMIT = 4",
        "n: 0..9 = 4",
        "power: 0..5 = 1",
        "go(speed 0..100) -> bool",
        "in       fault(code Fault)",
        "platform error.execution",
        "queue 3",
        "delayed 4  (default)",
        "idle  rest",
        "invariant: n < 9",
        "entry: n = 0; n = 1",
        "on start -> busy / n += 2  id begin",
        "on fault if event.code == Fault.jam -> idle / send done",
        "after 2s -> idle  watchdog",
        "always if go(5) -> main",
        "main  parallel",
        "back  deep history",
        "default -> r",
        "initial -> l  implied",
    ):
        assert any(row.endswith(f" {line}") or row == line for row in told.splitlines()), line
    assert "[" not in told


def test_the_origin_of_each_item(chart: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = show(capsys, chart, "--origin")
    for line in (
        "Fault: none, jam  [inherited base.yaml:3]",
        "LIMIT = 4  [overridden derived.yaml:5]",
        "T = 2s  [inherited base.yaml:4]",
        "n: 0..9 = 4  [inherited base.yaml:5]",
        "power: 0..5 = 1  [own derived.yaml:6]",
        "queue 3  [own derived.yaml:7]",
        "in       start  [inherited base.yaml:7]",
        "platform error.range  [platform]",
        "on start -> busy / n += 2  id begin  [overridden derived.yaml:11]",
        "busy  [inherited base.yaml:15]",
        "always if go(5) -> main  [own derived.yaml:13]",
        "after 2s -> idle  watchdog  [inherited base.yaml:17]",
        "r  [inherited base.yaml:21]",
    ):
        assert any(row.endswith(f" {line}") for row in told.splitlines()), line


def test_the_plan(chart: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = show(capsys, chart, "--plan")
    assert "plan of Derived" in told
    assert "0: Derived: 1 idle, 2 busy, 3 main" in told
    assert "busy always: within Derived: enter main, enter left, enter l" in told
    document = json.loads(show(capsys, chart, "--plan", "--json"))
    assert document["plan"]["regions"][0]["states"] == {"idle": 1, "busy": 2, "main": 3}
    assert len(document["plan"]["moves"]) == len(document["transitions"])


def test_json(chart: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(show(capsys, chart, "--json"))
    assert (document["name"], document["base"]) == ("Derived", "Base")
    assert [s["id"] for s in document["states"] if s["parent"] == "Derived"] == [
        "idle", "busy", "main",
    ]  # fmt: skip
    start = next(t for t in document["transitions"] if t["id"] == "begin")
    assert (start["origin"], start["targets"], start["content"]) == (
        "overridden", ["busy"], ["n += 2"],
    )  # fmt: skip
    assert start["at"]["line"] == 11
    timeout = next(t for t in document["transitions"] if t["trigger"] == "after")
    assert timeout["delay_us"] == 2_000_000
    assert document["capacities"]["queue"] == 3


def test_every_statement_is_spelt(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "all.yaml"
    text = """
        chart: All
        data: {a: "uint8[2] = 0", x: uint8 = 0, i: 0..1 = 0}
        operations: [halt()]
        events: {in: [go, q() -> 0..3], out: [o(v uint8)], internal: [n(v uint8)]}
        initial: s
        states:
          s:
            defer: go
            exit: |
              raise n(v = 1)
              send o(v = x) to peer
              send go after 500ms as later
              cancel later
              log "it is", x
              log
              if x == 1 { halt() } else if x == 2 { x = 1 } else { a[0] = 2 }
              for x, i in a { a[i] = 0 }
            every: {1s: {type: internal, ordered: true}}
            sometimes: {target: s}
            on: {q: {do: reply 2}, "*": s}
        """
    path.write_text(dedent(text))
    told = show(capsys, path)
    for part in (
        "raise n(v = 1);",
        "send o(v = x) to peer;",
        "send go after 500ms as later;",
        "cancel later;",
        'log "it is", x; log;',
        "if x == 1 { halt() } else if x == 2 { x = 1 } else { a[0] = 2 };",
        "for x, i in a { a[i] = 0 }",
        "defer go",
        "every 1s  internal, ordered",
        "sometimes -> s",
        "on q / reply 2",
        "on * -> s",
        "in       q() -> 0..3",
    ):
        assert part in told, part


def test_a_system(capsys: pytest.CaptureFixture[str]) -> None:
    cell = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"
    told = show(capsys, cell)
    assert "molder.mold_ready -> feeder.mold_ready" in told
    assert "P2: never plant.feeder_forward and not plant.door_closed" in told
    document = json.loads(show(capsys, cell, "--json"))
    assert [machine["name"] for machine in document["machines"]] == ["feeder", "molder", "plant"]


def test_a_chart_with_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wrong.scxml"
    path.write_text('<scxml version="1.0"><state id="a"><transition target="b"/></state></scxml>')
    assert execute(["show", str(path)]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "there is no state `b`" in printed.err


def test_a_missing_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["show", "nowhere.yaml"]) == 1
    assert "FK0101" in capsys.readouterr().err


SHOP = Path(__file__).parents[1] / "golden/shop.yaml"


def test_invoked_charts_stand_in_the_tree(capsys: pytest.CaptureFixture[str]) -> None:
    told = show(capsys, SHOP)
    for line in (
        "invoke: press(limit = price + 1)",
        "press: Press  autoforward",
        "finalize: heard += 1; last = event.n",
        "feeder: Feeder",
        "full",
    ):
        assert line in told, line


def test_invoked_charts_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(show(capsys, SHOP, "--json"))
    (press,) = document["invocations"]
    assert (press["id"], press["state"], press["given"]) == ("press", "work", ["limit"])
    assert press["autoforward"] is True
    assert press["chart"]["name"] == "Press"
    (feeder,) = press["chart"]["invocations"]
    assert [state["id"] for state in feeder["chart"]["states"][1:]] == ["full", "empty"]
    (work,) = [state for state in document["states"] if state["id"] == "work"]
    assert work["invoke"] == [["invoke press(limit = price + 1)"]]


MACHINES = Path(__file__).parents[2] / "machines"
LABELS = ("plain", "two\nlines", "a\ttab", "end \n", "[bold]not markup[/]", "", "ä電", "x" * 500)


def printed(tree: Tree) -> list[str]:
    """Return the lines that rich prints in a pipe."""
    with unwrapped.console.capture() as captured:
        unwrapped.console.print(tree)
    return captured.get().removesuffix("\n").split("\n")


@pytest.mark.slow
def test_a_tree_in_a_pipe_is_the_one_that_rich_prints() -> None:
    is_ascii = unwrapped.console.options.ascii_only
    charts = [p for p in sorted(MACHINES.rglob("*.yaml")) if p.read_text().startswith("chart:")]
    assert len(charts) > 20
    for path in charts[::3]:
        findings = Findings()
        written = read_sources(path, findings, {})
        assert isinstance(written, tuple)
        chart = elaborated(written, findings)
        for tree in (
            chart_tree(chart, origins(written), with_origin=True),
            plan_tree(lower(chart)),
        ):
            assert list(tree_lines(tree, is_ascii=is_ascii)) == printed(tree), path


def test_any_label_is_printed_as_rich_does() -> None:
    is_ascii = unwrapped.console.options.ascii_only
    draw = random.Random(5)
    for _ in range(50):
        tree = Tree(Text(draw.choice(LABELS)))
        nodes = [tree]
        for _ in range(draw.randrange(30)):
            nodes.append(draw.choice(nodes).add(Text(draw.choice(LABELS))))
        assert list(tree_lines(tree, is_ascii=is_ascii)) == printed(tree)


def test_a_deep_tree_needs_no_recursion() -> None:
    tree = node = Tree("0")
    for number in range(1, 5_000):
        node = node.add(str(number))
    lines = list(tree_lines(tree))
    assert (len(lines), lines[-1]) == (5_000, " " * 4 * 4_998 + "└── 4999")
