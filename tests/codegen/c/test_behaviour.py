"""Generated C at work: as a host meets it, and under sanitizers like the interpreter."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import dedent

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.limits import report_limits
from fsmkit.codegen.c.plugin import PLUGIN
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.testing.harness import c as harness
from fsmkit.testing.harness.harness import INTERPRETER

SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")
LAMP = """
    chart: Lamp
    types: {Colour: [red, green]}
    data: {count: 0..3 = 0, colour: Colour = Colour.red}
    inputs: {mains: bool}
    outputs: {power: 0..100 = 0}
    operations: ["lit(level 0..100) -> bool"]
    events:
      in: [toggle, "paint(colour Colour)", "ask() -> 0..3"]
      out: ["gone(count 0..3)"]
    capacity: {queue: 2}
    initial: dark
    states:
      dark:
        entry: power = 0
        on:
          toggle: {if: mains, target: bright, do: count += 1}
          paint: {do: colour = event.colour}
          ask: {do: reply count}
      bright:
        entry: |
          power = 40
          if lit(power) { send gone(count = count) }
        after: {100ms: dark}
"""
HOST = """
    #include "lamp.h"
    #include <stdio.h>
    #include <string.h>

    static lamp *lit_by;
    static unsigned gone;

    bool lamp_lit(lamp *m, uint8_t level)
    {
        lit_by = m;
        return level == 40u;
    }

    void lamp_send_gone(lamp *m, uint8_t count)
    {
        (void)m;
        gone = gone * 10u + count;
    }

    #define CHECK(condition)                                    \\
        if (!(condition)) {                                     \\
            printf("line %d: %s\\n", __LINE__, #condition);      \\
            return 1;                                           \\
        }

    int main(void)
    {
        lamp one, two, copy;
        uint32_t deadline = 0u;
        const uint32_t start = 0xFFFFFFD0u; /* the clock wraps around in between */
        lamp_state active[2];
        lamp_init(&one);
        lamp_init(&two);
        CHECK(memcmp(&one, &two, sizeof one) == 0);
        CHECK(!lamp_post_toggle(&one)); /* not started */
        one.in.mains = true;
        two.in.mains = true;
        lamp_start(&one, start);
        lamp_start(&two, start);
        CHECK(one.in.mains && lamp_in(&one, LAMP_STATE_DARK));
        CHECK(!lamp_next_deadline(&one, &deadline));
        CHECK(lamp_post_toggle(&one));
        CHECK(lamp_in(&one, LAMP_STATE_DARK)); /* posting does nothing yet */
        lamp_run(&one, start);
        CHECK(lit_by == &one && gone == 1u && one.out.power == 40u);
        CHECK(lamp_in(&one, LAMP_STATE_BRIGHT) && lamp_in(&two, LAMP_STATE_DARK));
        CHECK(lamp_active(&one, active, 2u) == 1u && active[0] == LAMP_STATE_BRIGHT);
        CHECK(two.data.count == 0u && two.out.power == 0u);
        CHECK(lamp_next_deadline(&one, &deadline) && deadline == start + 100u);
        lamp_run(&one, start + 99u);
        CHECK(lamp_in(&one, LAMP_STATE_BRIGHT));
        copy = one; /* a snapshot is a copy */
        lamp_run(&one, start + 100u);
        CHECK(lamp_in(&one, LAMP_STATE_DARK) && one.out.power == 0u);
        lamp_rebase(&copy, start + 99u);
        lamp_run(&copy, 1u);
        CHECK(lamp_in(&copy, LAMP_STATE_DARK));
        CHECK(lamp_post_toggle(&two) && lamp_post_toggle(&two) && !lamp_post_toggle(&two));
        CHECK(two.fsm.rejected == 1u);
        lamp_event e = LAMP_NO_EVENT;
        e.event = LAMP_EVENT_ASK;
        CHECK(lamp_dispatch(&one, &e, start + 100u) == FSM_HANDLED && one.fsm.reply == 1);
        e.event = LAMP_EVENT_PAINT;
        e.of.paint.colour = LAMP_COLOUR_GREEN;
        CHECK(lamp_dispatch(&one, &e, start + 100u) == FSM_HANDLED);
        CHECK(one.data.colour == LAMP_COLOUR_GREEN && two.data.colour == LAMP_COLOUR_RED);
        CHECK(lamp_fault(&one) == FSM_NO_FAULT && !lamp_finished(&one));
        CHECK(strcmp(lamp_state_name(LAMP_STATE_DARK), "dark") == 0);
        return 0;
    }
"""

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def lamp(tmp_path: Path) -> Chart:
    path = tmp_path / "lamp.yaml"
    path.write_text(dedent(LAMP), encoding="utf-8")
    return load(path)


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
def test_two_machines_side_by_side(
    lamp: Chart, compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    write(tmp_path, {**generate_machine(lamp).files, "host.c": dedent(HOST).lstrip()})
    compile_with(tmp_path, compiler, *SANITIZERS, "lamp.c", "fsm.c", "host.c", "-o", "host")
    done = subprocess.run([tmp_path / "host"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.cc
def test_like_the_interpreter_under_sanitizers(
    tmp_path: Path, require_tool: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", require_tool("gcc"))
    monkeypatch.setattr(harness, "FLAGS", (*harness.FLAGS, *SANITIZERS, f"-I{tmp_path}"))
    cases = []
    for number in range(8):
        case = random_case(19, number)
        findings = Findings()
        report_limits(case.chart, findings)
        if not findings.has_errors:
            cases.append(case)
    assert cases
    traces = harness.run_many([(case.chart, case.script) for case in cases])
    for case, trace in zip(cases, traces, strict=True):
        assert trace == INTERPRETER.run(case.chart, case.script)


def test_no_compiler_is_a_finding(lamp: Chart, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(FsmkitError) as caught:
        harness.run_many([(lamp, ["start 0"])])
    (finding,) = caught.value.diagnostics
    assert finding.rule.code == "FK0401"
    assert finding.help is not None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("chart: A\nabstract: true\ninitial: a\nstates: {a: {}}\n", "is abstract"),
        (
            "chart: A\ndata: {x: float64 = 1.5, y: uint64 = 0}\nstates: {a: {entry: y = x}}",
            "C cannot convert a floating-point number",
        ),
    ],
)
def test_says_what_c_cannot_express(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(text, encoding="utf-8")
    findings = Findings()
    assert PLUGIN.generate(load(path), findings, {}) is None
    (finding,) = [f for f in findings if f.rule.code.startswith("FK04")]
    assert message in finding.message
    assert finding.primary is not None
    assert finding.help is not None
