"""Operations on sources: the laws on random charts, and the layout of new entries."""

import shutil
from pathlib import Path

import pytest

from devtools.edits import Tally, run, sources
from fsmkit.diagnostics import FsmkitError, Source
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Kind, Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, inverted, read
from fsmkit.editor.editing.clipboard import copied
from fsmkit.editor.editing.documents import all_states, parent_of, state_of, transformed
from fsmkit.scxml.writer import write_document as write_scxml

CELL = Path("machines/production_cell")
GATE = """\
chart: Gate   # the gate of the yard
events: {in: [request, limit], out: [opened]}

operations:
  - motor(speed -1..1)

initial: closed
states:
  closed:
    on: {request: opening}   # somebody rings

  # It takes nine seconds.
  opening:
    entry: motor(1)
    on:
      limit: {target: open, do: send opened}
    after: {10s: stuck}

  open:
    after:
      3s: closed  # no longer
  stuck: {final: true}
"""


def edited(text: str, *operations: op.Operation, name: str = "gate.yaml") -> str:
    for operation in operations:
        source = Source(name, text)
        edits = apply(source, operation)
        text = apply_edits(text, edits)
        assert apply_edits(text, inverted(source, edits)) == source.text
        if not isinstance(operation, op.RenameSymbol):
            assert read(Source(name, text)) == transformed(read(source), operation)
    return text


def changes(text: str, *operations: op.Operation) -> list[str]:
    before, after = text.splitlines(), edited(text, *operations).splitlines()
    return [f"-{line}" for line in before if line not in after] + [
        f"+{line}" for line in after if line not in before
    ]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_laws_hold_on_random_charts_in_both_notations(seed: int) -> None:
    tally = Tally()
    for source in sources(seed):
        run(source, f"{seed}", 15, tally)
    assert tally.problems == []
    assert sum(tally.applied.values()) > 10


@pytest.mark.parametrize("name", ["feeder.yaml", "molder.yaml", "camera.scxml"])
def test_the_laws_hold_on_charts_of_the_cell(name: str) -> None:
    path = CELL / name
    tally = Tally()
    run(Source(str(path), path.read_text()), name, 15, tally)
    assert tally.problems == []
    assert sum(tally.applied.values()) > 5


LINES = [
    (op.AddState("", "waiting"), ["+  waiting: {}"]),
    (op.AddState("stuck2", "x"), None),
    (op.AddState("open", "held"), ["+    states:", "+      held: {}"]),
    (op.AddTransition("closed", ("stuck",), Trigger.EVENT, "limit"),
     ["-    on: {request: opening}   # somebody rings",
      "+    on: {request: opening, limit: stuck}   # somebody rings"]),
    (op.AddTransition("opening", ("closed",), Trigger.EVENT, "request", "1 < 2"),
     ["+      request: {if: 1 < 2, target: closed}"]),
    (op.SetGuard("closed", 0, "1 < 2"),
     ["-    on: {request: opening}   # somebody rings",
      "+    on: {request: {if: 1 < 2, target: opening}}   # somebody rings"]),
    (op.SetContent("open", 0, "motor(0)"),
     ["-      3s: closed  # no longer", "+      3s: {target: closed, do: motor(0)}  # no longer"]),
    (op.SetDelay("open", 0, "5s"),
     ["-      3s: closed  # no longer", "+      5s: closed  # no longer"]),
    (op.SetTarget("opening", 1, ("closed",)),
     ["-    after: {10s: stuck}", "+    after: {10s: closed}"]),
    (op.SetInitial("", ("open",)), ["-initial: closed", "+initial: open"]),
    (op.SetHandler("opening", "entry", ("motor(-1)",)),
     ["-    entry: motor(1)", "+    entry: motor(-1)"]),
    (op.SetHandler("opening", "exit", ("motor(0)",)), ["+    exit: motor(0)"]),
    (op.SetKind("stuck", Kind.ATOMIC), ["-  stuck: {final: true}", "+  stuck: {}"]),
    (op.Declare("in", "obstacle"),
     ["-events: {in: [request, limit], out: [opened]}",
      "+events: {in: [request, limit, obstacle], out: [opened]}"]),
    (op.Declare("operations", "lamp(on bool)"), ["+  - lamp(on bool)"]),
    (op.Declare("constants", "T_OPEN", "3s"), ["+constants:", "+  T_OPEN: 3s"]),
    (op.RemoveDeclaration("out", "opened"),
     ["-events: {in: [request, limit], out: [opened]}", "+events: {in: [request, limit]}"]),
    (op.RenameSymbol("state", "closed", "shut"),
     ["-initial: closed", "-  closed:", "-      3s: closed  # no longer",
      "+initial: shut", "+  shut:", "+      3s: shut  # no longer"]),
    (op.SetKey("", "doc", ("A gate.",)), ["+doc: A gate."]),
    (op.SetKey("open", "rest", ("true",)), ["+    rest: true"]),
    (op.RemoveState("open"),
     ["-      limit: {target: open, do: send opened}", "-    on:", "-  open:", "-    after:",
      "-      3s: closed  # no longer"]),
]  # fmt: skip


@pytest.mark.parametrize(("operation", "lines"), LINES, ids=lambda one: type(one).__name__)
def test_an_operation_changes_few_lines(operation: op.Operation, lines: list[str] | None) -> None:
    if lines is None:
        with pytest.raises(FsmkitError, match="no state"):
            edited(GATE, operation)
    else:
        assert sorted(changes(GATE, operation)) == sorted(lines) or operation == op.RemoveState(
            "open"
        )


PASTED = """\
states:
  a:
    entry: log(1)
    on: {go: b, back: {target: c, if: In(a.inner) and a > b}}
    initial: a.inner
    states: {a.inner: {on: {done.state.a: b}}}
  b: {}
"""


@pytest.mark.parametrize("name", ["x.yaml", "x.scxml"])
def test_pasted_states_with_taken_names_get_numbers(name: str) -> None:
    text = "chart: X\nevents: {in: [go, back]}\nstates: {a: {}, b2: {}, b: {}, c: {}}\n"
    if name.endswith("scxml"):
        text = write_scxml(read(Source("x.yaml", text)))
    result = read(Source(name, edited(text, op.Paste("c", PASTED), name=name)))
    pasted = state_of(result, "a2")
    assert [one.value for t in pasted.transitions for one in t.targets] == ["b3", "c"]
    assert str(pasted.transitions[1].guard) == "In(a.inner) and a > b"
    assert state_of(result, "a.inner").transitions[0].events[0].value == "done.state.a2"
    assert parent_of(result, pasted) is state_of(result, "c")
    again = read(Source(name, edited(text, op.Paste("c", PASTED), op.Paste("", PASTED), name=name)))
    assert {"a3", "a.inner2", "b4"} <= {s.id.value for s in all_states(again) if s.id}
    assert copied(again, [state_of(again, "b4")]) == "states:\n  b4: {}\n"


NO_PARTS = (
    "", "hello", "a: b", "chart: X\nstates: {}", "states: 3", "- 3", "{", "a: {on: 3}", "# only",
    "states: {}", "transitions: []", "a: {}\na: {}", "\x00", "[]", "<scxml/>",
    "states: {pasted.transitions: {}}", "import os\nprint(1)",
)  # fmt: skip


@pytest.mark.parametrize("text", NO_PARTS)
def test_a_text_that_is_no_part_of_a_chart_is_rejected(text: str) -> None:
    with pytest.raises(FsmkitError, match="not a part of a chart"):
        apply(Source("gate.yaml", GATE), op.Paste("closed", text))


LIKE_YAML = ("on: {a: open}", "- {on: a, target: open}", "  after: {1s: open}",
             "transitions:\n\t- always: true")  # fmt: skip


@pytest.mark.parametrize("text", LIKE_YAML)
def test_transitions_are_pasted_as_a_yaml_chart_has_them(text: str) -> None:
    before, after = (
        read(Source("g.yaml", GATE)),
        read(Source("g.yaml", edited(GATE, op.Paste("open", text)))),
    )
    count = len(state_of(before, "open").transitions)
    assert len(state_of(after, "open").transitions) == count + 1
    with pytest.raises(FsmkitError, match="has no transitions"):
        edited(GATE, op.Paste("stuck", text))


@pytest.mark.parametrize("remark", ["", " # why"])
@pytest.mark.parametrize("key", ["always: true", "on: go", "after: 5s"])
@pytest.mark.parametrize("more", ["", ", type: internal, ordered: true"])
def test_a_line_of_a_list_that_grows_keeps_its_comment(remark: str, key: str, more: str) -> None:
    line = f"      - {{{key}, id: first, target: a{more}}}{remark}\n"
    text = f"chart: X\nstates:\n  a:\n    transitions:\n{line}{line.replace('first', 'other')}"
    for index in (0, 1):
        content = op.SetContent("a", index, "log(12345678901234567890)\nlog(2)")
        guard = op.SetGuard("a", index, " and ".join(["1 < 2"] * 12))
        for operations in ((content,), (guard,), (guard, content)):
            assert edited(text, *operations).count("# why") == text.count("# why")


def test_a_moved_state_takes_its_comments_and_lines_along() -> None:
    text = edited(GATE, op.AddState("", "working"), op.MoveState("opening", "working"))
    assert (
        text[text.index("  working:") :]
        == """\
  working:
    states:
      # It takes nine seconds.
      opening:
        entry: motor(1)
        on:
          limit: {target: open, do: send opened}
        after: {10s: stuck}
"""
    )
    back = edited(text, op.MoveState("opening", "", "open"), op.RemoveState("working"))
    assert back.split() == GATE.split()


def test_an_unwrapped_state_is_as_before() -> None:
    wrapped = edited(GATE, op.WrapInState(("opening", "open"), "working"))
    assert "  working:\n    states:\n      # It takes nine seconds.\n      opening:\n" in wrapped
    assert read(Source("g", edited(wrapped, op.UnwrapState("working")))) == read(Source("g", GATE))


REJECTED = [
    (op.AddState("", "open"), "there is a state `open` already"),
    (op.AddState("", "9 lives"), "not a name"),
    (op.AddState("stuck", "inner"), "no children"),
    (op.RemoveState("gone"), "no state `gone`"),
    (op.RemoveState(""), "cannot be removed"),
    (op.MoveState("open", "open"), "into itself"),
    (op.SetInitial("open", ("closed",)), "no initial state"),
    (op.SetInitial("", ("gone",)), "no state `gone`"),
    (op.SetKind("opening", Kind.FINAL), "has transitions"),
    (op.AddTransition("stuck", ("open",)), "no transitions"),
    (op.AddTransition("open", ("gone",)), "no state `gone`"),
    (op.AddTransition("open", ("closed",), Trigger.EVENT, ""), "event is missing"),
    (op.AddTransition("open", ("closed",), Trigger.AFTER, " "), "delay is missing"),
    (op.SetTarget("open", 7, ()), "no transition 7"),
    (op.SetDelay("closed", 0, "5s"), "no delay"),
    (op.SetContent("open", 0, "motor(("), "motor"),
    (op.SetKey("open", "states", ("x",)), "cannot be set"),
    (op.Declare("constants", "motor", "1"), "declared already"),
    (op.Declare("parts", "x", "1"), "no section"),
    (op.RemoveDeclaration("data", "x"), "has no `x`"),
    (op.OverrideState("open"), "has no base"),
    (op.UnwrapState("open"), "not a composite"),
    (op.WrapInState(("open",), "closed"), "already"),
    (op.RenameSymbol("state", "open", "closed"), "already"),
    (op.RenameSymbol("state", "gone", "x"), "no state `gone`"),
]


@pytest.mark.parametrize(("operation", "reason"), REJECTED, ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_an_operation_that_does_not_fit_is_rejected(
    operation: op.Operation, reason: str, notation: str
) -> None:
    text = GATE if notation == "yaml" else write_scxml(read(Source("gate.yaml", GATE)))
    with pytest.raises(FsmkitError) as found:
        apply(Source(f"gate.{notation}", text), operation)
    assert reason in str(found.value)


def test_a_file_that_cannot_be_read_is_rejected_with_its_findings() -> None:
    with pytest.raises(FsmkitError, match="broken-yaml"):
        apply(Source("gate.yaml", "chart: [\n"), op.AddState("", "open"))


HOSTILE = [
    'a"b',
    "a'b",
    "a: b",
    "a # b",
    "<b>&amp;",
    "*x",
    "&x",
    "a\tb",
    "{",
    "[a, b]",
    "- a",
    "ü\u2028x",
]


@pytest.mark.parametrize("text", HOSTILE)
@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_hostile_texts_are_quoted(text: str, notation: str) -> None:
    start = GATE if notation == "yaml" else write_scxml(read(Source("gate.yaml", GATE)))
    name = f"gate.{notation}"
    made = edited(start, op.SetKey("closed", "doc", (text,)), name=name)
    assert read(Source(name, made)).root.children[0].doc == text


def test_scxml_keeps_comments_and_gets_the_layout_of_its_siblings() -> None:
    text = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" name="G">
    <!-- closed at night -->
    <state id="closed">
        <transition event="go" target="open"/> <!-- rings -->
    </state>
    <state id='open' />
</scxml>
"""
    made = edited(
        text,
        op.AddTransition("open", ("closed",), Trigger.AFTER, "3s"),
        op.AddState("", "stuck", Kind.FINAL),
        op.SetGuard("closed", 0, "1 < 2"),
        name="g.scxml",
    )
    assert (
        made
        == """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" name="G" xmlns:fk="urn:fsmkit:scxml">
    <!-- closed at night -->
    <state id="closed">
        <transition event="go" target="open" cond="1 &lt; 2"/> <!-- rings -->
    </state>
    <state id='open'>
      <transition fk:after="3s" target="closed"/>
    </state>
    <final id="stuck"/>
</scxml>
"""
    )


def test_the_long_form_reads_charts_of_a_folder(tmp_path: Path) -> None:
    shutil.copy(CELL / "belt.yaml", tmp_path)
    tally = Tally()
    for path in tmp_path.iterdir():
        run(Source(str(path), path.read_text()), "1", 5, tally)
    assert tally.problems == []
