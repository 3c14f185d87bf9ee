"""Statecharts of Rhapsody: their charts, rejected constructs, damaged archives."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path

import pytest

from fsmkit.chart.elaborate import elaborate
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, Severity, Source
from fsmkit.document.front_ends import FrontEnd
from fsmkit.foreign.imports import Import
from fsmkit.foreign.rhapsody.reader import decode, import_machine, machines
from fsmkit.plugins import plugin
from tests.foreign.rhapsody.archives import (
    archive,
    as_xml,
    connector,
    default,
    event,
    handle,
    move,
    operation,
    state,
    typed,
)

TWO = (state("closed"), state("open"))


def imported(text: str) -> tuple[Import | None, list[str]]:
    """Return a machine that also elaborates, and the messages of errors."""
    findings = Findings()
    found = import_machine(Source("door.sbs", text), "Door", findings)
    if found is not None and not findings.has_errors:
        elaborate((found.document,), findings)
    return found, [one.message for one in findings if one.severity is Severity.ERROR]


def written(text: str) -> str:
    """Return the chart of a machine as YAML, which is the same from both formats of archives."""
    charts = []
    for archived in (text, as_xml(text)):
        found, errors = imported(archived)
        assert found is not None
        assert not errors
        charts.append(plugin(FrontEnd, "yaml").write(found.document))
    assert charts[0] == charts[1]
    return charts[0]


def test_a_machine_is_read() -> None:
    text = archive(
        [
            state("closed", exit="bell();"),
            state("open"),
            state("ajar", "open"),
            state("wide", "open"),
        ],
        [
            default("root", "closed", "count = 0;"),
            default("open", "ajar"),
            move("closed", "open", trigger="evPush", guard="count < 3", action="count++;"),
            move("ajar", "wide", trigger="tm(1500)"),
            move("open", "closed", trigger="evShut"),
            move("closed", "closed", static=1, trigger="evKnock", action="bell();"),
        ],
        attributes=[typed("IAttribute", "count", "int", "2")],
    )
    found = written(text)
    assert "count: int32 = 2" in found
    assert found[found.index("initial:") :] == (
        "initial:\n  target: closed\n  do: count = 0\n\nstates:\n  closed:\n    exit: bell()\n"
        "    on:\n      evPush: {if: count < 3, target: open, do: count += 1}\n"
        "      evKnock: {do: bell()}\n  open:\n    initial: ajar\n    on: {evShut: closed}\n"
        "    states:\n      ajar: {after: {1500ms: wide}}\n      wide: {}\n"
    )


@pytest.mark.parametrize(
    ("place", "name"), [("here", "evPush"), ("in another unit", "evPush()"), ("nowhere", "")]
)
def test_a_renamed_event_has_its_new_name(place: str, name: str) -> None:
    """The text of a trigger keeps the old name; the reference has an id, or also a name."""
    text = archive(
        TWO,
        [default("root", "closed"), move("closed", "open", trigger="evPush")],
        events=[event("evPush")] if place == "here" else (),
    ).replace('_body = "evPush"', '_body = "evOld"')
    if name.endswith(")"):
        text = text.replace(
            "- _id = GUID event-evPush;", f'- _id = GUID event-evPush;\n- _name = "{name}";'
        )
    assert f"on: {{{'evOld' if place == 'nowhere' else 'evPush'}: open}}" in written(text)


@pytest.mark.parametrize(
    ("target", "values", "entry"),
    [
        ("lamp", (), "send lamp_evOn"),
        ("lamp", ("this", "3"), "lamp_GEN_evOn_this_3()"),
        ("", (), None),
    ],
)
def test_a_state_that_sends_an_event(
    target: str, values: tuple[str, ...], entry: str | None
) -> None:
    data = "".join(f'{{ IHandleWithData\n- _data = "{one}";\n}}\n' for one in values)
    name = {"name": f'"{target}"'} if target else {}
    action = (
        f"- _entryAction = {{ ISendAction\n- m_hTarget = {handle('IPort', **name)}\n"
        f"- m_hEvent = {handle('IEvent', id='GUID event-evOn')}\n"
        f"- _ArgValCount = {len(values)};\n- value = {data}}}\n"
    )
    sending = state("lit", kind="EventState").replace("- _defaultTrans", f"{action}- _defaultTrans")
    text = archive(
        [state("off"), sending],
        [default("root", "off"), move("off", "lit", trigger="evPush"), move("lit", "off")],
        events=[event("evOn")],
    )
    if entry is None:
        assert "names no event, or no target" in imported(text)[1][0]
    else:
        assert f"lit: {{entry: {entry}, always: [off]}}" in written(text)


def test_parts_in_a_circle_are_no_machine() -> None:
    text = as_xml(archive(TWO, [default("root", "closed")]))
    lists = "<AggregatesList><value>GUID {}</value></AggregatesList>"
    looped = text.replace("</IStateChart>", lists.format("self") + "</IStateChart>")
    findings = Findings()
    assert machines(Source("door.sbsx", looped), findings) == ("Door",)
    circle = "".join(
        f'<IClass type="e"><_id type="a">GUID {a}</_id>{lists.format(b)}</IClass>'
        for a, b in (("a", "b"), ("b", "a"), ("c", "c"))
    )
    text = f"<RhapsodyArchive><RHAPSODY-MODEL>{circle}</RHAPSODY-MODEL></RhapsodyArchive>"
    assert machines(Source("door.sbsx", text), findings) == ()


def test_regions_history_and_final_states() -> None:
    text = archive(
        [state("work", kind="And"), state("a", "work"), state("b", "work"), state("a1", "a"),
         state("a2", "a"), state("b1", "b"), state("rest"), state("end", kind="LocalTermination")],
        [default("root", "rest"), default("a", "a1"), default("b", "b1"),
         move("a1", "a2", trigger="go"), move("work", "rest", trigger="pause"),
         move("rest", "h", trigger="resume"), move("h", "a1"), move("rest", "end", trigger="stop")],
        connectors=[connector("h", "History", "a")],
    )  # fmt: skip
    found = written(text)
    assert "h: {history: deep, default: a1}" in found
    assert "regions:" in found
    assert "end: {final: true}" in found


def test_guards_of_a_path_are_joined() -> None:
    text = archive(
        TWO,
        [default("root", "closed"),
         move("closed", "c", trigger="e", guard="x > 1", action="x = 0;"),
         move("c", "closed", guard="else"), move("c", "open", guard="x > 2", action="bell();")],
        connectors=[connector("c", "Condition")],
        attributes=[typed("IAttribute", "x", "int")],
    )  # fmt: skip
    found = written(text)
    assert found[found.index("on:") :] == (
        "on:\n      e:\n        - {if: (x > 1) && (x > 2), target: open, do: x = 0; bell()}\n"
        "        - {if: x > 1, target: closed, do: x = 0}\n  open: {}\n"
    )


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        ("gen(new evOpen());", "send evOpen"),
        ("this->GEN(evOpen);", "send evOpen"),
        ("CGEN(me, evOpen());", "send evOpen"),
        ("getLock().gen(new evOpen());", "send lock_evOpen"),
        ("OPORT(lock)->GEN(evOpen);", "send lock_evOpen"),
        ("CGEN_PORT(me->lock, evOpen());", "send lock_evOpen"),
        ("me->x = params->level;", "x = event.level"),
        ("itsOther.gen(new evOpen());", "itsOther_gen_new_evOpen()"),
    ],
)
def test_content(action: str, expected: str) -> None:
    text = archive(
        TWO,
        [default("root", "closed"), move("closed", "open", trigger="e", action=action)],
        attributes=[typed("IAttribute", "x", "int")],
        events=[event("e", [typed("IArgument", "level", "int")])],
    )
    assert f"do: {expected}" in written(text)


@pytest.mark.parametrize(
    ("attribute", "body", "guard"),
    [
        ("x", "return x > 2;", "check()"),
        ("x", "return 1;", "getX() > 2"),
        ("x", "other.x = 3;", "check()"),
    ],
)
def test_an_attribute_that_operations_use_belongs_to_the_host(
    attribute: str, body: str, guard: str
) -> None:
    text = archive(
        TWO,
        [
            default("root", "closed"),
            move("closed", "open", trigger="e", guard=guard, action="x = 1;"),
        ],
        attributes=[typed("IAttribute", attribute, "int")],
        operations=[operation("check", body)],
    )
    assert "data:" not in written(text)


def test_a_computed_timeout_is_a_delayed_event() -> None:
    text = archive(TWO, [default("root", "closed"), move("closed", "open", trigger="tm(wait())")])
    found = written(text)
    assert "entry: send timeout_closed as timeout_closed after (wait())" in found
    assert "exit: cancel timeout_closed" in found


@pytest.mark.parametrize(
    ("states", "moves", "connectors", "message"),
    [
        (TWO, [move("closed", "open")], (), "no default transition"),
        (TWO, [default("root", "closed"), move("closed", "gone")], (), "a loose end"),
        (TWO, [default("root", "closed")], [connector("f", "Fork")], "the type `Fork` is not read"),
        ((*TWO, state("odd", kind="Odd")), [default("root", "closed")], (), "the type `Odd`"),
        ((*TWO, state("p", "q"), state("q", "p")), [default("root", "closed")], (), "in a circle"),
        (TWO, [default("root", "closed"), move("closed", "open", action="log(gen(new e()));")],
         (), "sent to the machine itself"),
        (TWO, [default("root", "closed"), move("closed", "open", action="helper();")], (),
         "in the operation `helper`"),
    ],
)  # fmt: skip
def test_what_no_chart_does_is_rejected(
    states: tuple[str, ...], moves: list[str], connectors: list[str], message: str
) -> None:
    operations = [operation("helper", "inner();"), operation("inner", "this.gen(new e());")]
    _, errors = imported(archive(states, moves, connectors=connectors, operations=operations))
    assert any(message in one for one in errors), errors


def ladder(steps: int) -> tuple[list[str], list[str]]:
    """Return connectors in a row, each with two legs to the next, and their transitions."""
    names = [f"c{number}" for number in range(steps)]
    moves = [move(a, b, guard=g) for a, b in pairwise([*names, "open"]) for g in ("x()", "else")]
    return [connector(name, "Condition") for name in names], moves


@pytest.mark.parametrize(
    ("connectors", "moves", "message"),
    [
        (*ladder(40), "more than 1000 paths"),
        ([connector("c0", "Condition")], [move("c0", "c0")], "does not end at a state"),
        ([connector("c0", "Condition")], [], "does not end at a state"),
    ],
)
def test_paths_that_no_one_can_expand_are_rejected(
    connectors: list[str], moves: list[str], message: str
) -> None:
    first = [default("root", "closed"), move("closed", "c0", trigger="e")]
    _, errors = imported(archive(TWO, [*first, *moves], connectors=connectors))
    assert any(message in one for one in errors), errors


def test_the_open_order_of_transitions_is_reported() -> None:
    text = archive(
        TWO,
        [default("root", "closed"), move("closed", "open", trigger="e", guard="a()"),
         move("closed", "closed", trigger="e", guard="b()")],
    )  # fmt: skip
    found, _ = imported(text)
    assert found is not None
    assert "the order of transitions of `closed` is open" in found.differs[0].message


@pytest.mark.parametrize("is_xml", [False, True])
def test_damaged_archives_have_findings_only(is_xml: bool) -> None:
    text = archive(
        TWO,
        [default("root", "closed"), move("closed", "open", trigger="e", guard='a == "x\\""')],
        attributes=[typed("IAttribute", "x", "int", "1")],
    )
    whole = (as_xml(text) if is_xml else text).encode()
    chance = random.Random(3)
    for _ in range(300):
        data = bytearray(whole)
        if chance.random() < 0.5:
            data = data[: chance.randrange(len(data))]
        else:
            data[chance.randrange(len(data))] = chance.randrange(256)
        findings = Findings()
        source = decode(bytes(data), "broken.sbs", findings)
        assert source is not None
        for machine in machines(source, findings):
            import_machine(source, machine, findings)


def test_files_of_other_kinds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text, message in (
        ("a.rpyx", '<?xml version="1.0"?><a/>', "is not an archive"),
        ("d.rpyx", "<RhapsodyArchive><RHAPSODY-MODEL/>", "broken-xml"),
        ("b.sbs", "nothing", "is not an archive"),
        ("c.cls", archive(TWO, [default("root", "closed")]).replace("{ IClass", "{" * 300), "300"),
    ):
        (tmp_path / name).write_text(text)
        assert execute(["check", str(tmp_path / name)]) == 1
        told = capsys.readouterr().err
        assert message in told or "foreign-syntax" in told
