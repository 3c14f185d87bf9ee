"""Models of QM: their charts, the rejected constructs, and broken files."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from fsmkit.chart.elaborate import elaborate
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, Severity, Source
from fsmkit.document.front_ends import FrontEnd
from fsmkit.foreign.imports import Import
from fsmkit.foreign.qm.reader import import_machine, machines
from fsmkit.plugins import plugin

HEAD = '<model version="7.0.3"><package name="P">'
TAIL = "</package></model>"
A = '<state name="a">'
ENTRY = "<entry>%s</entry>"
TICKS = "QTimeEvt_armX(&amp;me-&gt;timer, 2U, 2U);"
DISARM = "QTimeEvt_disarm(&amp;me-&gt;timer);"
CHOICE = '<tran trig="E"><action>f();</action><choice><guard>g()</guard></choice></tran>'
HISTORY = '<history type="deep" target="../1"/>'
CONSTRUCTOR = (
    '<operation name="Lamp_ctor" type="void"><code>QActive_ctor(&amp;me-&gt;super, '
    "Q_STATE_CAST(&amp;Lamp_initial));\nQTimeEvt_ctorX(&amp;me-&gt;timer, &amp;me-&gt;super, "
    "TIMEOUT_SIG, 0U);</code></operation>"
)


def model(inside: str, *, attributes: str = "", initial: str = "") -> str:
    """Return a model with one class; the first state is the initial one."""
    return (
        f'{HEAD}<class name="Lamp" superclass="qpc::QActive">{attributes}{CONSTRUCTOR}'
        f'<statechart><initial target="../1">{initial}</initial>{inside}</statechart>'
        f"</class>{TAIL}"
    )


def imported(text: str) -> tuple[Import | None, list[str]]:
    """Return a machine that also elaborates, and the messages of errors."""
    findings = Findings()
    found = import_machine(Source("lamp.qm", text), "Lamp", findings)
    if found is not None and not findings.has_errors:
        elaborate((found.document,), findings)
    return found, [one.message for one in findings if one.severity is Severity.ERROR]


def written(text: str) -> str:
    """Return the states of a machine as YAML."""
    found, errors = imported(text)
    assert found is not None
    assert not errors
    yaml = plugin(FrontEnd, "yaml").write(found.document)
    return yaml[yaml.index("initial:") :]


def test_a_machine_is_read() -> None:
    text = model(
        '<state name="off"><entry>led_off();</entry><tran trig="PRESS" target="../../2"/></state>'
        '<state name="on"><entry>me->presses++; led_on();</entry>'
        '<tran trig="PRESS"><choice target="../../../1"><guard>me->presses &lt; 10</guard></choice>'
        '<choice target="../../../3"><guard>else</guard></choice></tran></state>'
        '<state name="worn"/>',
        attributes='<attribute name="presses" type="uint8_t"/>',
    ).replace("->", "-&gt;")
    assert written(text) == (
        "initial: off\n\nstates:\n  off: {entry: led_off(), on: {PRESS: on}}\n  on:\n"
        "    entry: presses += 1; led_on()\n    on:\n      PRESS:\n"
        "        - {if: presses < 10, target: off}\n        - worn\n  worn: {}\n"
    )


@pytest.mark.parametrize(
    ("entry", "exit_", "expected"),
    [
        ("QTimeEvt_armX(&me->timer, BSP_TICKS_PER_SEC/2U, 0U);", "QTimeEvt_disarm(&me->timer);",
         ["entry: send TIMEOUT as timer after 500ms", "exit: cancel timer"]),
        ("QTimeEvt_armX(&me->timer, BSP_TICKS_PER_SEC*3U, BSP_TICKS_PER_SEC*3U);",
         "(void)QTimeEvt_disarm(&me->timer);", ["3s: {do: send TIMEOUT}"]),
        ("QTimeEvt_armX(&me->timer, wait_time(), 0U);", "QTimeEvt_disarm(&me->timer);",
         ["entry: send TIMEOUT as timer after (wait_time())"]),
        ("static QEvt const e = QEVT_INITIALIZER(PRESS_SIG);\nQACTIVE_POST(&me->super, &e, me);",
         "", ["entry: send PRESS"]),
        ("QACTIVE_POST(Q_ACTIVE_UPCAST(me), Q_NEW(QEvt, PRESS_SIG), me);", "", ["send PRESS"]),
        ("Q_UNUSED_PAR(par); QS_SIG_DICTIONARY(A_SIG, me); (void)e;", "", ["off: {on: {"]),
    ],
)  # fmt: skip
def test_calls_of_the_framework(entry: str, exit_: str, expected: list[str]) -> None:
    inside = (
        f'<state name="off"><entry>{entry}</entry><exit>{exit_}</exit>'
        '<tran trig="TIMEOUT, PRESS" target="../../2"/></state><state name="on"/>'
    )
    found = written(
        model(inside.replace("->", "-&gt;").replace("&me", "&amp;me").replace("&e", "&amp;e"))
    )
    assert all(part in found for part in expected), found


CPP = (
    (
        "QTimeEvt_armX(&amp;me-&gt;timer, BSP_TICKS_PER_SEC, 0U);",
        "timer.armX(BSP::TICKS_PER_SEC, 0U);",
    ),
    ("(void)QTimeEvt_disarm(&amp;me-&gt;timer);", "(void)this-&gt;timer.disarm();"),
    (
        "static QEvt const done = QEVT_INITIALIZER(DONE_SIG); QACTIVE_POST(me, &amp;done, me);",
        "static QP::QEvt const done(DONE_SIG); POST(&amp;done, this);",
    ),
    (
        "QACTIVE_POST_LIFO(&amp;me-&gt;super, Q_NEW(QEvt, DONE_SIG));",
        "postLIFO(QP::QF::q_new&lt;QP::QEvt&gt;(APP::DONE_SIG));",
    ),
    ("QActive_subscribe(&amp;me-&gt;super, GO_SIG);", "subscribe(APP::GO_SIG);"),
    ("me-&gt;count = 3U; me-&gt;is_on = 1U;", "count = 3U; this-&gt;is_on = 1U;"),
    ("QTimeEvt_armX(&amp;me-&gt;timer, 2U, 4U);", "this-&gt;timer.armX(2U, 4U);"),
    ("f(QTimeEvt_disarm(&amp;me-&gt;timer));", "f(timer.disarm());"),
    (
        "if (QActive_defer(&amp;me-&gt;super, &amp;me-&gt;q, e)) { g(); }",
        "if (defer(&amp;q, e)) { g(); }",
    ),
)
"""Calls of QP/C, and the same of QP/C++."""


@pytest.mark.parametrize(("c", "cpp"), CPP)
def test_calls_of_both_languages_are_the_same(c: str, cpp: str) -> None:
    attributes = '<attribute name="count" type="uint8_t"/><attribute name="is_on" type="bool"/>'
    inside = f"{A}{ENTRY}</state>"
    whole = model(inside % c, attributes=attributes)
    other = model(inside % cpp, attributes=attributes).replace("qpc::", "qpcpp::")
    other = other.replace(
        "QTimeEvt_ctorX(&amp;me-&gt;timer, &amp;me-&gt;super, TIMEOUT_SIG, 0U);",
        "Lamp() : timer(this, TIMEOUT_SIG, 0U) {}",
    )
    found, errors = imported(whole)
    again, other_errors = imported(other)
    assert found is not None
    assert again is not None
    assert errors == other_errors
    if not errors:
        assert found.document.root == again.document.root
        assert found.document.data == again.document.data


def test_a_time_event_for_ever_needs_a_state_around_all() -> None:
    arm = "QTimeEvt_armX(&amp;me-&gt;timer, BSP_TICKS_PER_SEC, BSP_TICKS_PER_SEC);"
    inside = '<state name="off"><tran trig="TIMEOUT" target="../../2"/></state><state name="on"/>'
    found = written(model(inside, initial=f"<action>{arm}</action>"))
    assert "initial: active" in found
    assert "1s: {do: send TIMEOUT}" in found


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (f'{A}<tran trig="E" target="../../7"/></state>', "names no state"),
        (f'{A}<tran trig="E" target="../../x/-1/99999999"/></state>', "names no state"),
        (f'{A}<tran target="../../1"/></state>', "has no trigger"),
        (f"{A}<submachine/></state>", "`<submachine>` is not read"),
        (f"{A}{ENTRY % 'QActive_defer(me, q, e);'}</state>", "an event is deferred or recalled"),
        (f"{A}{ENTRY % 'if (x) { QTimeEvt_armX(t, 3U, 0U); }'}</state>", "a time event is armed"),
        (
            f"{A}{ENTRY % 'QEvt *e = make(); QACTIVE_POST(me, e, me);'}</state>",
            "posted to the mach",
        ),
        (f"{A}{ENTRY % TICKS}<exit>{DISARM}</exit></state>", "whose length is unknown"),
        (f"{A}{CHOICE}</state>", None),
        (f'{A}<tran trig="E" target="../2"/><state name="b">{CHOICE}</state></state>', "pass the"),
        (f'{A}<tran trig="E" target="../2"/><state name="b"/>{HISTORY}</state>', "may leave the"),
        (f'{A}<state name="b"/><history type="odd" target="../0"/></state>', "neither shallow nor"),
    ],
)
def test_what_no_chart_does_is_rejected(inside: str, message: str | None) -> None:
    _, errors = imported(model(inside))
    assert not errors if message is None else any(message in one for one in errors), errors


def test_names_of_any_kind() -> None:
    inside = '<state name="if"><tran trig="send" target="../../2"/></state><state name="größe !"/>'
    found, errors = imported(model(inside))
    assert found is not None
    assert not errors
    assert {event.name.value for event in found.document.events} == {"send_event"}


def test_broken_files_have_findings_only() -> None:
    whole = model('<state name="a"><tran trig="E" target="../../1"/></state>')
    chance = random.Random(5)
    for _ in range(300):
        text = bytearray(whole.encode())
        if chance.random() < 0.5:
            text = text[: chance.randrange(len(text))]
        else:
            text[chance.randrange(len(text))] = chance.randrange(32, 127)
        source, findings = Source("broken.qm", text.decode()), Findings()
        for machine in machines(source, findings):
            import_machine(source, machine, findings)


def test_a_file_with_several_machines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = model('<state name="a"/>')
    two = one.replace(HEAD, "").replace('"Lamp"', '"Fan"').replace(TAIL, "")
    (tmp_path / "two.qm").write_text(one.replace(TAIL, two + TAIL))
    assert execute(["check", str(tmp_path / "two.qm")]) == 1
    assert "choose one with `--machine`: `Lamp`, `Fan`" in capsys.readouterr().err
    assert execute(["show", str(tmp_path / "two.qm"), "--machine", "Fan"]) == 0
    (tmp_path / "other.qm").write_text("<nothing/>")
    assert execute(["check", str(tmp_path / "other.qm")]) == 1
    assert "is not a model of QM" in capsys.readouterr().err
