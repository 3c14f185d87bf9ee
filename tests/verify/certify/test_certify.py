"""Certificates: equal executions, seeded faults, files that changed, processors."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify import certify as certifying
from fsmkit.verify.certify.certificate import read, seal
from fsmkit.verify.certify.comparison import Request
from fsmkit.verify.certify.program import Program, program_of
from tests.needs import need, tool

GATE = Path(__file__).parents[3] / "fsmkit" / "cli" / "examples" / "gate" / "gate.yaml"
RICH = Path(__file__).parent / "rich.yaml"
STEPS = 1_200
"""Steps of the chart with all kinds of values: each kind of step, in some states."""
COMPILERS = {
    "Cortex-M0": "arm-none-eabi-gcc -mcpu=cortex-m0 -Os",
    "Cortex-M0+": "arm-none-eabi-gcc -mcpu=cortex-m0plus -O0",
    "Cortex-M3": "arm-none-eabi-gcc -mcpu=cortex-m3 -O2",
    "Cortex-M4": "arm-none-eabi-gcc -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2",
    "Cortex-M33": "arm-none-eabi-gcc -mcpu=cortex-m33 -Os",
    "RV32IMC": "riscv64-unknown-elf-gcc -march=rv32imc -mabi=ilp32 -ffreestanding -Os",
    "AArch64": "aarch64-linux-gnu-gcc -O2",
    "PowerPC": "powerpc-linux-gnu-gcc -Os",
}


def chart_of(path: Path) -> Chart:
    return read_chart(path, Findings())


def certified(path: Path, command: str = "", limit: int = 100_000, form: str = "") -> Any:
    return certifying.certify(
        chart_of(path), Request(tuple(command.split()), limit=limit, form=form)
    )


@pytest.mark.cc
@pytest.mark.parametrize("form", ["", "size", "compiling"])
def test_c_on_this_computer_is_equal(form: str) -> None:
    document = certified(GATE, form=form)
    assert document["result"] == "complete"
    assert document["differences"] == []
    assert document["coverage"]["transitions"] == {"covered": 9, "all": 9}
    assert document["coverage"]["pairs"] == {"covered": 10, "all": 10}
    assert document["steps"] > 100


SENDS = "act(); " + 'send unknown to "#_parent"; ' * 3 + 'send o to "#_parent"; act()'
LEAVING = {
    "regions": (
        "events: {in: [go], out: [o]}\ninitial: p\nstates:\n"
        "  p:\n    regions:\n"
        "      l: {initial: a, states: {a: {on: {go: {target: b, do: send o}}}, b: {}}}\n"
        "      r: {initial: c, states: {c: {on: {go: {target: d, do: send o}}}, d: {}}}\n"
        "    after: {1s: {target: q, do: send o}}\n"
        "  q: {on: {go: {target: p, do: send o}}}\n"
    ),
    "end": (
        "events: {in: [go], out: [o]}\ninitial: a\nstates:\n"
        "  a: {exit: send o, on: {go: {target: z, do: send o}}}\n"
        "  z: {final: true, entry: send o}\n"
    ),
}  # fmt: skip
"""Charts that call their host between the exit and the entry of states."""


@pytest.mark.cc
@pytest.mark.parametrize("kind", ["drive", *LEAVING])
def test_calls_between_exit_and_entry_are_equal(kind: str, tmp_path: Path) -> None:
    path = GATE.with_name("drive.yaml")
    if kind in LEAVING:
        path = tmp_path / "chart.yaml"
        path.write_text(f"chart: Leaving\n{LEAVING[kind]}")
    document = certified(path)
    assert (document["result"], document["differences"]) == ("complete", [])


@pytest.mark.cc
@pytest.mark.parametrize("queue", [1, 4])
def test_posts_during_calls_of_a_machine_in_a_slot_are_equal(queue: int, tmp_path: Path) -> None:
    """The host posts to the invoker while a machine within calls it and sends to the same queue."""
    path = tmp_path / "chart.yaml"
    path.write_text(f"""\
chart: Outer
capacity: {{queue: {queue}}}
events: {{in: [go, o]}}
data: {{n: 0..3 = 0}}
initial: a
states:
  a:
    invoke:
      - id: inner
        content:
          chart: Inner
          events: {{in: [go], out: [o, unknown]}}
          operations: [act]
          initial: i
          states: {{i: {{on: {{go: {{do: '{SENDS}'}}}}}}}}
    on:
      go: {{do: 'send go to "#_inner"'}}
      o: {{do: n = (n + 1) % 4}}
""")
    document = certified(path, limit=2_000)
    assert document["differences"] == []
    assert document["repeated"] > 0


@pytest.mark.cc
def test_a_limit_makes_a_certificate_partial(tmp_path: Path) -> None:
    out = tmp_path / "made.json"
    arguments = ["certify", str(GATE), "--limit", "10", "--out", str(out)]
    assert execute(arguments) == 1
    document = json.loads(out.read_text())
    assert document["result"] == "partial"
    assert document["states_left"] > 0
    assert execute([*arguments, "--allow-partial"]) == 0


def mutated(program: Program, old: str, new: str) -> Program:
    name = f"{program.prefix}.c"
    text = program.files[name]
    assert old in text
    return Program(
        program.machine, {**program.files, name: text.replace(old, new, 1)}, program.shipped, True
    )


@pytest.mark.cc
def test_each_faulty_call_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drop a call in the generated C, or name another machine in it: each fault is found."""
    chart = chart_of(GATE)
    program = program_of(chart, None, certifying.options_of(""))
    text = program.files["gate.c"]
    lines = [
        line
        for line in dict.fromkeys(text.splitlines())
        if line.startswith("    ") and line.rstrip().endswith(");") and "gate_motor(" in line
    ]
    assert len(lines) >= 3
    others = [line.replace("gate_motor(m,", "gate_motor(m + 1,") for line in lines]
    for line, other in [*((line, "    ;") for line in lines), *zip(lines, others, strict=True)]:
        assert other != line
        faulty = mutated(program, line, other)
        monkeypatch.setattr(certifying, "program_of", lambda *_, faulty=faulty: faulty)
        document = certified(GATE)
        assert document["result"] == "different", line
        assert document["differences"][0]["what"].startswith("interpreter and C")


CALLS = {
    "a step may start within a step": ("    m->fsm.busy = true;\n", ""),
    "an event is dispatched within a step": ("return FSM_BUSY;", ";"),
    "an entry is visible too late": (
        ("    m->fsm.active = GATE_STATE_OPENING;\n    FSM_HOOK_ENTER(m, GATE_STATE_OPENING);\n"
        "    gate_arm(m, GATE_TIMER_OPENING_T_MOVE, GATE_T_MOVE);\n    gate_motor(m, 1);\n"),
        ("    gate_arm(m, GATE_TIMER_OPENING_T_MOVE, GATE_T_MOVE);\n    gate_motor(m, 1);\n"
        "    m->fsm.active = GATE_STATE_OPENING;\n"),
    ),
    "unhandled events do not count": ("    fsm_count(&m->fsm.unhandled);\n", ""),
    "rejected events count twice": (
        "        fsm_count(&m->fsm.rejected);\n", "        m->fsm.rejected += 2u;\n",
    ),
}  # fmt: skip
"""Faults that a host sees only during calls or in counters: old and new code."""


UNREAD = {
    "read": "if (m->in.blocked) { m->fsm.unhandled += 2u; }",
    "written": "m->in.blocked = false;",
    "copied": "{ volatile bool seen = m->in.blocked; (void)seen; }",
}
"""Statements with an input that the chart does not read there; the last one is no fault."""


@pytest.mark.cc
@pytest.mark.parametrize(
    "where", ["1", pytest.param("!defined CERTIFY_HOST", marks=pytest.mark.external)]
)
@pytest.mark.parametrize("fault", UNREAD)
def test_the_binary_reads_an_input_that_the_chart_does_not_read(
    fault: str, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ""
    if where != "1":
        command = COMPILERS["Cortex-M0"]
        require(command)
    count = "    fsm_count(&m->fsm.unhandled);\n"
    program = program_of(chart_of(GATE), None, certifying.options_of(""))
    plain = certified(GATE, command)
    faulty = mutated(program, count, f"#if {where}\n{UNREAD[fault]}\n#endif\n{count}")
    monkeypatch.setattr(certifying, "program_of", lambda *_: faulty)
    document = certified(GATE, command)
    assert document["steps"] == plain["steps"] or document["differences"]
    if fault == "copied":
        assert (document["result"], document["differences"]) == ("complete", [])
        if command:  # each combination is executed
            assert plain["emulated"] < document["emulated"]
    else:
        assert document["result"] == "different"


@pytest.mark.cc
@pytest.mark.parametrize("fault", CALLS)
def test_a_fault_that_shows_during_calls_is_found(
    fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = program_of(chart_of(GATE), None, certifying.options_of(""))
    faulty = mutated(program, *CALLS[fault])
    monkeypatch.setattr(certifying, "program_of", lambda *_: faulty)
    document = certified(GATE)
    assert document["result"] == "different"
    assert document["differences"][0]["what"].startswith("interpreter and C")


@pytest.mark.cc
def test_an_edited_certificate_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chart, out = tmp_path / "gate.yaml", tmp_path / "made.json"
    shutil.copy(GATE, chart)
    assert execute(["certify", str(chart), "--out", str(out)]) == 0
    assert "every reachable step is equal" in capsys.readouterr().out
    assert "Assumptions" in out.with_suffix(".html").read_text()
    assert execute(["certify", "--verify", str(out), "--again"]) == 0
    document = read(out)
    for key, value in (("steps", 10**9), ("result", "partial"), ("assumptions", [])):
        out.write_text(json.dumps({**document, key: value}))
        assert execute(["certify", "--verify", str(out)]) == 1
        assert "was edited" in capsys.readouterr().err
    out.write_text(json.dumps(seal({**document, "steps": 1})))
    assert execute(["certify", "--verify", str(out), "--again"]) == 1
    assert "`steps` is different" in capsys.readouterr().err
    out.write_text(json.dumps(document))
    chart.write_text(chart.read_text() + "# a comment\n")
    assert execute(["certify", "--verify", str(out)]) == 1
    assert "`" + str(chart) + "` has changed" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"certificate": 99}', "\udcff"])
def test_other_files_are_no_certificates(content: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(FsmkitError, match="not a certificate"):
        read(path)


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize("processor", COMPILERS)
def test_binaries_of_other_processors_are_equal(processor: str) -> None:
    require(COMPILERS[processor])
    document = certified(RICH, COMPILERS[processor], limit=STEPS)
    assert document["differences"] == []
    assert document["target"] == processor
    found = {row["step"]: row for row in document["maxima"]}
    assert found["dispatch go"]["instructions"] > 20
    assert found["dispatch go"]["stack"] >= 4
    assert (found["dispatch go"]["cycles"] is not None) == processor.startswith("Cortex-M0")


def require(command: str) -> None:
    tool(command.split(maxsplit=1)[0])
    try:
        import elftools  # noqa: F401
        import unicorn  # noqa: F401
    except ImportError:
        need(False, "unicorn")


@pytest.mark.cc
@pytest.mark.external
@pytest.mark.parametrize(
    ("command", "rule"),
    [
        ("avr-gcc -mmcu=atmega328p -Os", "certify-processor"),
        ("arm-none-eabi-gcc -mcpu=cortex-a7 -Os", "certify-processor"),
        ("arm-none-eabi-gcc -mcpu=cortex-m0 -mbig-endian -Os", "certify-processor"),
        ("riscv64-unknown-elf-gcc -Os", "certify-processor"),
        ("arm-none-eabi-gcc -mcpu=cortex-m0 --no-such-flag", "certify-build"),
    ],
)
def test_other_processors_and_failing_compilers_are_rejected(command: str, rule: str) -> None:
    require(command)
    with pytest.raises(FsmkitError) as error:
        certified(GATE, command)
    assert error.value.diagnostics[0].rule.name == rule


@pytest.mark.cc
def test_a_missing_compiler_is_rejected() -> None:
    with pytest.raises(FsmkitError, match="cannot be started"):
        certified(GATE, "no-such-compiler -Os")
