"""The generated code of a binding with all types: it is compiled, run, and compared in parts."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, Severity
from fsmkit.plugins import plugin

HERE = Path(__file__).parent / "wide"
RequireTool = Callable[[str], str]
WARNINGS = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow")
CHART = """\
chart: Wide
constants: {LOW: -5, T_LONG: 2s, YES: true, BIG: 18446744073709551615}
types:
  Mode: [off, slow, fast]
  Pair: {a: 0..1000, b: -3..3, c: bool, d: Mode, e: "uint8[2]", f: float32}
inputs:
  i8: -5..100
  u64: uint64
  i64: int64
  f32: float32
  f64: float64
  flag: bool
  mode: Mode
  span: duration
  table: "0..10[3]"
  modes: "Mode[2]"
  pair: Pair
outputs: {o8: -5..100, of: float32, om: Mode, ot: "0..10[3]", op: Pair, ob: bool}
operations:
  - weigh(slot 0..3) -> 0..200
  - ask() -> Mode
  - measure() -> float64
  - put(pair Pair, int uint8, value 0..3, values uint8[2])
  - nothing(unused bool)
events: {in: [go, "sent(pair Pair)"], out: ["gone(ctx 0..9, m Mode)"]}
initial: idle
data: {seen: 0..200, how: Mode, raw: "uint8[2] = [1, 2]"}
states:
  idle:
    on:
      go: {do: "seen = weigh(1); how = ask(); of = measure(); put(pair, 7, 3, raw);
        nothing(true); o8 = i8; om = mode; ot = table; op = pair; ob = flag;
        send gone(ctx = 4, m = how)"}
"""
BINDING = """\
binding: Wide
chart: wide.yaml
include: wide_host.h
context: {expression: "host_of(m)", type: struct host}
constants: {LOW: HOST_LOW, T_LONG: HOST_LONG, YES: HOST_YES, BIG: HOST_BIG}
types:
  Mode: {type: enum host_mode, members: {off: HOST_OFF, slow: HOST_SLOW, fast: 2}}
  Pair: {type: struct host_pair, fields: {a: bits.a, b: b, c: bits.c, d: mode, e: bytes, f: f}}
operations:
  weigh: ctx->weight + (int)slot
  ask: ctx->answer
  measure: ctx->measured
  put: host_put(ctx, &pair, int, value, values[1])
  nothing: (void)host_count++
sends:
  gone: host_gone(ctx, (uint8_t)m)
inputs:
  i8: ctx->i8
  u64: ctx->u64
  i64: ctx->i64
  f32: ctx->f32
  f64: ctx->f64
  flag: ctx->flags & 1u
  mode: ctx->mode
  span: ctx->span
  table: ctx->table
  modes: ctx->modes
  pair: ctx->pair
outputs:
  o8: ctx->o8
  of: ctx->of
  om: {set: ctx->om = value}
  ot: ctx->ot
  op: ctx->op
  ob: {set: "ctx->ob = value, host_count++"}
"""
PRINTED = """\
put 1000 -3 1 1 8 9 0.5 0, 7 3 2
0 0: 42 18446744073709551615 -9223372036854775808 1.50 2.25 1 2 77 123 12 \
| 42 3.5 2 123 1000 1 | 101 1 41
put 1000 -3 1 1 8 9 0.5 0, 7 3 2
8 10: 100 18446744073709551615 -9223372036854775808 1.50 2.25 1 2 2013265919 103 12 \
| 100 3.5 2 103 1000 1 | 0 0 40
"""


def generated(
    folder: Path, extra: str = "", chart: str = CHART, text: str = BINDING, **options: str
) -> tuple[dict[str, str] | None, Findings]:
    """Return the files of the chart with the binding, and the findings."""
    (folder / "wide.yaml").write_text(chart, encoding="utf-8")
    (folder / "wide.c.yaml").write_text(text + extra, encoding="utf-8")
    options |= {"binding": str(folder / "wide.c.yaml")}
    findings = Findings()
    made = plugin(Target, "c").generate(load(folder / "wide.yaml"), findings, options)
    return None if made is None else dict(made.files), findings


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["cc", pytest.param("clang", marks=pytest.mark.external)])
@pytest.mark.parametrize("without", ["", "counters"])
def test_values_of_all_types_go_in_and_out(
    without: str, compiler: str, tmp_path: Path, require_tool: RequireTool
) -> None:
    files, _ = generated(tmp_path, **({"without": without} if without else {}))
    assert files is not None
    program, printed = (HERE / "main.c").read_text(encoding="utf-8"), PRINTED
    host = (HERE / "wide_host.h").read_text(encoding="utf-8")
    if without:
        program = program.replace("rejected, machine.fsm.rejected", "rejected, 0u")
        printed = PRINTED.replace("8 10:", "8 0:")
    for name, text in {**files, "wide_host.h": host, "main.c": program}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    sources = ("main.c", "wide.c", "wide_bind.c", "fsm.c")
    done = subprocess.run(
        [require_tool(compiler), *WARNINGS, "-Werror", *sources, "-o", "wide"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    ran = subprocess.run([tmp_path / "wide"], capture_output=True, text=True, check=True)
    assert ran.stdout == printed


def test_a_trusted_value_is_taken_as_it_is(tmp_path: Path) -> None:
    trusted = BINDING.replace("i8: ctx->i8", "i8: {get: ctx->i8, trusted: true}")
    trusted = trusted.replace(
        "weigh: ctx->weight + (int)slot", "weigh: {call: weigh(slot), trusted: true}"
    )
    files, _ = generated(tmp_path, text=trusted)
    assert files is not None
    assert "m->in.i8 = ctx->i8;" in files["wide_bind.c"]
    assert "return weigh(slot);" in files["wide_bind.c"]


def test_constants_are_exported_as_the_binding_says(tmp_path: Path) -> None:
    texts = {}
    for exports in ("define", "enum", "none"):
        files, _ = generated(tmp_path, f"exports: {exports}\n")
        assert files is not None
        texts[exports] = files["wide.h"]
    assert "#define WIDE_LOW (-5)" in texts["define"]
    assert "enum { WIDE_LOW = -5 };" in texts["enum"]
    assert "WIDE_LOW" not in texts["none"]


def test_chosen_names_are_those_in_c(tmp_path: Path) -> None:
    chosen = """\
names:
  type Mode: wide_mode_code
  member Mode.slow: WIDE_CREEPS
  operation ask: wide_question
  event go: begin
  state idle: waiting
  input i8: small
  output o8: shown
  data seen: looked
  constant LOW: WIDE_LEAST
  field slot: pan
"""
    files, findings = generated(tmp_path, chosen)
    assert files is not None
    assert [each.rule.name for each in findings if each.severity is Severity.ERROR] == []
    header = files["wide.h"]
    for text in (
        "wide_mode_code;",
        "WIDE_CREEPS",
        "wide_question(wide *m)",
        "wide_post_begin(",
        "WIDE_EVENT_BEGIN",
        "WIDE_STATE_WAITING",
        "int8_t small;",
        "int8_t shown;",
        "looked;",
        "#define WIDE_LEAST (-5)",
        "uint8_t pan)",
    ):
        assert text in header
    assert "ctx->weight + (int)pan" in files["wide_bind.c"]
    assert "->in.small" in files["wide.c"]


@pytest.mark.parametrize(
    ("names", "rule", "message"),
    [
        ("type Mode: mode_code", "unfit-binding", "lacks the prefix"),
        ("operation ask: wide_init", "c-name-taken", "`wide_init` is taken"),
        ("operation ask: wide_weigh", "c-name-taken", "wide_weigh"),
        ("constant BIG: WIDE_BIG", "unfit-binding", "has no name in C"),
        ("input i8: int", "c-name-taken", "`int` is taken"),
    ],
)
def test_a_chosen_name_that_is_taken_is_refused(
    names: str, rule: str, message: str, tmp_path: Path
) -> None:
    files, findings = generated(tmp_path, f"names: {{{names}}}\n")
    assert files is None
    errors = [each for each in findings if each.severity is Severity.ERROR]
    assert rule in {each.rule.name for each in errors}
    assert any(message in each.message for each in errors)
    assert all(each.primary is not None for each in errors)


def test_a_binding_names_one_of_two_that_clash(tmp_path: Path) -> None:
    chart = "chart: Wide\nevents: {in: [a-b, a_b]}\ninitial: s\n"
    chart += "states: {s: {on: {a-b: t, a_b: t}}, t: {}}\n"
    head = "binding: Wide\nchart: wide.yaml\n"
    files, _ = generated(tmp_path, chart=chart, text=head)
    assert files is not None
    assert "wide_post_a_b_" in files["wide.h"]
    files, _ = generated(tmp_path, "names: {event a-b: a_minus_b}\n", chart, head)
    assert files is not None
    assert "wide_post_a_b_" not in files["wide.h"]
    assert "wide_post_a_minus_b" in files["wide.h"]
