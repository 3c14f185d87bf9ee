"""Generated C as compilers see it: no warning, no symbol too many, sizes as stated."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.codegen.c.limits import report_limits
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.python.generate import module_text
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Direction

ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines/production_cell"
SHOP = ROOT / "tests/golden/shop.yaml"
"""It invokes machines, which invoke others."""
COMPILERS = ("gcc", "clang", "g++", "clang++")
RANDOM = 6
"""Random charts that each compiler gets."""

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def machines() -> list[Machine]:
    found = [generate_machine(load(CELL / f"{name}.yaml")) for name in ("feeder", "molder")]
    found.append(generate_machine(load(SHOP), "shop"))
    for number in range(RANDOM):
        chart = random_case(7, number).chart
        findings = Findings()
        report_limits(chart, findings)
        if not findings.has_errors:
            found.append(generate_machine(chart, f"random_{number}"))
    assert len(found) > 2
    return found


@pytest.mark.cc
@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_warning(
    machines: list[Machine], compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    for machine in machines:
        write(tmp_path, machine.files)
    sources = [name for machine in machines for name in machine.files if name.endswith(".c")]
    sources = [name for name in sources if name != "fsm.c"]
    compile_with(tmp_path, compiler, "-c", *sources, "fsm.c")


ONE_DELAYED = """
chart: One
capacity: {delayed: 1}
events: {in: [go]}
initial: a
states:
  a: {on: {go: {target: b, do: send go after 1s as beat}}}
  b: {on: {go: a}, exit: cancel beat}
"""


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_room_for_one_delayed_event(
    compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    chart = tmp_path / "one.yaml"
    chart.write_text(ONE_DELAYED)
    write(tmp_path, generate_machine(load(chart)).files)
    assert "#define ONE_DELAYED 1u" in (tmp_path / "one.h").read_text()
    compile_with(tmp_path, compiler, "-Wtype-limits", "-c", "one.c", "fsm.c")


HOSTILE_NAMES = """<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml"
    version="1.0" datamodel="fsmkit" name="Hostile*/int">
  <datamodel><data id="x*/" fk:type="uint8" expr="0"/></datamodel>
  <fk:type name="R"><fk:field name="1e309" type="uint8"/><fk:field name="a; b" type="uint8"/>
    <fk:field name="a__b" type="uint8"/><fk:field name="größe" type="uint8"/></fk:type>
  <fk:type name="goTo" members="x y"/>
  <fk:operation signature="goto(e uint8, i uint8[2], result bool, uint8_t bool) -> bool"/>
  <fk:operation signature="go_to(int uint8) -> bool"/>
  <fk:event direction="in" signature="ev(e uint8, i uint8[2], result R, größe bool)"/>
  <fk:event direction="out" signature="o(e uint8, i uint8[2], result R, größe bool)"/>
  <state id="a"><transition event="ev"><send event="o"><param name="e" expr="event.e"/>
    <param name="i" expr="event.i"/><param name="result" expr="event.result"/>
    <param name="größe" expr="goto(1, event.i, true, go_to(1))"/></send></transition></state>
  <parallel id="p*/"><onentry><log label="*/" expr="1"/></onentry>
    <state id="q*/" initial="r*/"><history id="h*/" type="deep"><transition target="r*/"/></history>
      <state id="r*/"><transition event="ev" target="h*/"/></state>
      <state id='&quot;&quot;&quot;&#10;\\'><transition fk:after="1s" target="q*/"/><onexit>
        <log label="\\" expr="1"/></onexit></state></state>
    <state id="/*"><onexit><log label="a" expr="2"/></onexit></state></parallel>
</scxml>"""


@pytest.mark.cc
@pytest.mark.parametrize("compiler", COMPILERS)
def test_names_that_are_none_in_c(
    compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    path = tmp_path / "hostile.scxml"
    path.write_text(HOSTILE_NAMES, encoding="utf-8")
    write(tmp_path, generate_machine(load(path), "hostile").files)
    compile_with(tmp_path, compiler, "-c", "hostile.c", "fsm.c")


def test_names_that_are_none_in_python(tmp_path: Path) -> None:
    path = tmp_path / "hostile.scxml"
    path.write_text(HOSTILE_NAMES, encoding="utf-8")
    compile(module_text(load(path)), "hostile.py", "exec")


@pytest.mark.cc
@pytest.mark.parametrize("names", ["", "-DFSM_NO_NAMES"])
def test_sizes_are_as_stated(
    machines: list[Machine], names: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    lines = []
    for machine in machines:
        write(tmp_path, machine.files)
        prefix, upper = machine.names.prefix, machine.names.upper
        lines.append(f'#include "{prefix}.h"')
        size = machine.figures["struct_bytes"]
        lines.append(f"typedef char {prefix}_{size}[sizeof({prefix}) == {size} ? 1 : -1];")
        lines.append(f"typedef char {prefix}_same[{upper}_STRUCT_BYTES == {size} ? 1 : -1];")
    (tmp_path / "sizes.c").write_text("\n".join(lines) + "\n", encoding="utf-8")
    compile_with(tmp_path, "gcc", *filter(None, [names]), "-c", "sizes.c")
    compile_with(tmp_path, "gcc", *filter(None, [names]), "-c", f"{machines[0].names.prefix}.c")


@pytest.mark.slow
@pytest.mark.cc
def test_needs_nothing_but_what_the_header_declares(
    machines: list[Machine],
    tmp_path: Path,
    compile_with: Compile,
    write: Write,
    require_tool: Callable[[str], str],
) -> None:
    nm = require_tool("nm")
    for machine in machines:
        names = machine.names
        prefix = names.prefix
        write(tmp_path, machine.files)
        compile_with(tmp_path, "gcc", "-O2", "-ffreestanding", "-c", f"{prefix}.c")
        listed = subprocess.run(
            [nm, "-u", f"{prefix}.o"], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        undefined = {line.split()[-1] for line in listed.stdout.splitlines() if line.strip()}
        operations = {f"{prefix}_{name}" for name in names.operations.values()}
        sent = {
            f"{prefix}_send_{names.event_names[event.index]}"
            for event in names.chart.events
            if Direction.OUT in event.directions
        }
        library = {s for s in undefined if s.startswith("fsm_")} | {"memcpy", "memset", "memmove"}
        invoked = {s for s in undefined if s.startswith(tuple(m.prefix for m in names.invoked))}
        assert undefined <= operations | sent | library | invoked


@pytest.mark.cc
def test_has_no_data_that_changes(
    machines: list[Machine],
    tmp_path: Path,
    compile_with: Compile,
    write: Write,
    require_tool: Callable[[str], str],
) -> None:
    nm = require_tool("nm")
    for machine in machines:
        prefix = machine.names.prefix
        write(tmp_path, machine.files)
        compile_with(tmp_path, "gcc", "-c", f"{prefix}.c")
        listed = subprocess.run(
            [nm, f"{prefix}.o"], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        kinds = {line.split()[-2] for line in listed.stdout.splitlines()}
        assert not kinds & set("bBDC"), listed.stdout  # `d`: tables of names, relocated


def test_same_chart_gives_same_text() -> None:
    chart = load(CELL / "feeder.yaml")
    assert generate_machine(chart).files == generate_machine(load(CELL / "feeder.yaml")).files


NAMES = """
chart: Press
types: {Fault: [none, hot], Way: [up, down]}
events: {in: ["report(code Fault)", a-b, by.name], out: ["failed(code Fault)"]}
operations: ["run(way Way)", "seen() -> Way"]
data: {register: 0..9 = 0, last: Way = up}
initial: idle
states:
  idle:
    on:
      report: [{do: "last = seen()\\nrun(last)\\nrun(Way.down)\\nsend failed(code = event.code)"}]
      a-b: {do: "register = 1", if: "register == 0"}
      by.name: done
  done: {}
"""


@pytest.mark.cc
@pytest.mark.parametrize("compiler", COMPILERS)
def test_functions_of_hosts_have_the_types_of_enumerations(
    compiler: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    path = tmp_path / "press.yaml"
    path.write_text(NAMES, encoding="utf-8")
    files = generate_machine(load(path), options=Options(extras=frozenset({"trace"}))).files
    for declared in (
        "bool press_post_report(press *m, press_fault_kind code);",
        "void press_send_failed(press *m, press_fault_kind code);",
        "void press_run_operation(press *m, press_way way);",
        "press_way press_seen(press *m);",
        "uint8_t last; /* press_way */",
    ):
        assert declared in files["press.h"]
    assert "press_run_operation(m, PRESS_WAY_DOWN);" in files["press.c"]
    write(tmp_path, files)
    compile_with(tmp_path, compiler, "-c", "press.c", "press_info.c", "fsm.c")
    compile_with(tmp_path, compiler, "-c", "press_trace.c", "fsm_trace.c")


def test_the_header_lists_the_names_that_differ(tmp_path: Path) -> None:
    path = tmp_path / "press.yaml"
    path.write_text(NAMES, encoding="utf-8")
    text = generate_machine(load(path)).files["press.h"]
    listed = text.partition("that are different in C:")[2].partition("*/")[0]
    assert [line.strip(" *") for line in listed.splitlines() if line.strip(" *")] == [
        "type Fault: press_fault_kind",
        "operation run: press_run_operation",
        "event by.name: press_post_by_name_event",
        "variable register: data.register_value",
    ]


def test_says_where_each_transition_was_written() -> None:
    text = generate_machine(load(CELL / "feeder.yaml")).files["feeder.c"]
    line = next(
        number
        for number, line in enumerate((CELL / "feeder.yaml").read_text().splitlines(), 1)
        if "pushing:" in line
    )
    assert "/* feeder.yaml:" in text
    assert any(f"feeder.yaml:{line + k}  pushing -> " in text for k in range(12))
    assert str(ROOT) not in text


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_library(compiler: str, tmp_path: Path, compile_with: Compile) -> None:
    library = ROOT / "fsmkit/runtime/c"
    arguments = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"]
    files = [str(library / "fsm.c"), str(ROOT / "tests/c/fsm_test.c")]
    compile_with(tmp_path, compiler, *arguments, f"-I{library}", *files, "-o", "fsm_test")
    done = subprocess.run([tmp_path / "fsm_test"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'


@pytest.mark.cc
@pytest.mark.parametrize(
    "body",
    [
        '<state id="a"/>',
        '<state id="a"><transition event="go" target="a"/></state>',
        '<parallel id="p"><state id="a"/><state id="b"/></parallel>',
        '<parallel id="p"><state id="a"/><state id="b"><transition cond="1"/></state></parallel>',
    ],
)
def test_what_nothing_uses_is_not_there(
    body: str, tmp_path: Path, compile_with: Compile, write: Write
) -> None:
    """An unused function or parameter is a warning: small charts, and those that forgive errors."""
    (tmp_path / "small.scxml").write_text(f"{HEAD}{body}</scxml>", encoding="utf-8")
    write(tmp_path, generate_machine(load(tmp_path / "small.scxml")).files)
    compile_with(tmp_path, "gcc", "-c", "small.c")
