"""A generated module as a host uses it, and names that would be code."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.javascript.generate import file_name, module_text
from fsmkit.codegen.javascript.plugin import PLUGIN
from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings, FsmkitError

COUNTER = """\
chart: Counter
doc: Counts what passes, in parts of a thousand.
data: {total: int64 = 0, last: "0..1000"}
outputs: {half: float32}
operations: [lamp(on bool), "weight() -> 0..1000"]
events:
  in: ["part(size int64)", stop]
  out: ["counted(total int64)"]
initial: idle
states:
  idle:
    on:
      part:
        if: event.size > 0
        target: busy
        do: |
          total += event.size
          last = weight()
          half = total / 3
          send counted(total = total)
          log "sum", total
  busy:
    entry: lamp(true)
    exit: lamp(false)
    after: {250ms: idle}
    on: {stop: done}
  done: {final: true}
"""
HOST = """\
import { Counter } from "./counter.mjs";
const told = [];
const machine = new Counter({ lamp: (on) => told.push(on), weight: () => 7 });
machine.trace = (line) => told.push(line);
machine.send = (event, payload, peer) => told.push([event, ...payload.map(String), peer]);
machine.log = (label, value) => told.push([label, String(value)]);
machine.start(0);
told.push(machine.post("part", 2n ** 40n), machine.run(0), machine.isIn("busy"));
told.push(machine.nextDeadline());
told.push(machine.run(250), machine.active(), String(machine.data.total), machine.outputs.half);
for (const wrong of [
  () => machine.post("nothing"),
  () => machine.post("part"),
  () => new Counter({ lamp() {} }),
  () => machine.isIn("nowhere"),
]) {
  try {
    wrong();
  } catch (error) {
    told.push(error.message);
  }
}
console.log(JSON.stringify(told));
"""


SAVER = """\
import { Counter } from "./counter.mjs";
const made = () => new Counter({ lamp() {}, weight: () => 7 });
const [one, other] = [made(), made()];
one.start(0);
one.post("part", 5n);
one.run(10);
const saved = one.save();
other.restore(saved, 1000);
console.log(other.active().join(), other.data.total, other.nextDeadline());
let refused = 0;
for (let at = 0; at < saved.length; at += 1) {
  const broken = saved.slice();
  broken[at] ^= 1;
  try {
    other.restore(broken);
  } catch (error) {
    refused += error instanceof RangeError;
  }
}
console.log(refused - saved.length, other.active().join());
const lampless = new Counter({ lamp() { throw new Error("broken"); }, weight: () => 7 });
lampless.start(0);
for (const wrong of [() => lampless.dispatch("part", 1n), () => lampless.save()]) {
  try {
    wrong();
  } catch (error) {
    console.log(error.message);
  }
}
"""


FILES = {"counter.mjs", "counter.d.mts", "fsmkit_runtime.mjs", "fsmkit_runtime.d.mts"}
HOST_TYPED = """\
import { Counter } from "./counter.mjs";
const lit: boolean[] = [];
const machine = new Counter({ lamp: (on) => void lit.push(on), weight: () => 7 });
machine.send = (event, payload, peer) => {
  const total: bigint = payload[0];
  const name: "counted" = event;
  const to: string | null = peer;
  void [total, name, to];
};
machine.start(0);
const isQueued: boolean = machine.post("part", 5n);
const isBusy: boolean = machine.isIn("busy");
const last: number = machine.data.last;
const total: bigint = machine.data.total;
const saved: Uint8Array = machine.save();
machine.restore(saved, 1000);
void [isQueued, isBusy, last, total];
"""
MISTAKES = (
    'machine.post("part");',
    'machine.post("part", 5);',
    'machine.post("counted", 5n);',
    'machine.isIn("nowhere");',
    "machine.data.total = 5n;",
    "machine.data.nothing;",
    "new Counter({ lamp() {} });",
    'new Counter({ lamp() {}, weight: () => "7" });',
)


def made(text: str, folder: Path, extras: str = "") -> Generated:
    (folder / "chart.yaml").write_text(text, encoding="utf-8")
    generated = PLUGIN.generate(load(folder / "chart.yaml"), Findings(), {"with": extras})
    assert generated is not None
    for name, content in generated.files.items():
        (folder / name).write_text(content, encoding="utf-8")
    return generated


@pytest.mark.external
def test_a_host(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    made(COUNTER, tmp_path)
    (tmp_path / "host.mjs").write_text(HOST, encoding="utf-8")
    done = subprocess.run(
        [require_tool("node"), "host.mjs"],
        cwd=tmp_path, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert (done.stderr, done.returncode) == ("", 0)
    assert "1099511627776" in done.stdout
    for part in (
        '["counted","1099511627776",null]', '["sum","1099511627776"]', "true,true,true,250",
        'true,["idle"],"1099511627776",366503886848',
        '"Counter receives no event nothing","part carries 1 values, not 0"',
        '"the host lacks what Counter calls: weight","Counter has no state nowhere"',
    ):  # fmt: skip
        assert part in done.stdout, done.stdout


@pytest.mark.external
def test_a_saved_machine(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    generated = made(COUNTER, tmp_path, "save")
    assert set(generated.files) == {*FILES, "fsmkit_saving.mjs"}
    (tmp_path / "saver.mjs").write_text(SAVER, encoding="utf-8")
    done = subprocess.run(
        [require_tool("node"), "saver.mjs"],
        cwd=tmp_path, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert (done.stderr, done.returncode) == ("", 0)
    assert done.stdout.splitlines() == [
        "busy 5n 1250", "0 busy", "broken", "Counter was broken off in the midst of a step",
    ]  # fmt: skip


@pytest.mark.external
def test_types(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    made(COUNTER, tmp_path, "save")
    (tmp_path / "host.mts").write_text(HOST_TYPED, encoding="utf-8")
    wrong = "".join(f"// @ts-expect-error\n{line}\n" for line in MISTAKES)
    (tmp_path / "wrong.mts").write_text(HOST_TYPED + wrong, encoding="utf-8")
    options = ["--noEmit", "--strict", "--module", "nodenext", "--target", "es2020"]
    done = subprocess.run(
        [require_tool("tsc"), *options, "host.mts", "wrong.mts"],
        cwd=tmp_path, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert (done.stdout, done.returncode) == ("", 0)


def test_declarations(tmp_path: Path) -> None:
    text = str(made(COUNTER, tmp_path).files["counter.d.mts"])
    for part in (
        'import { Machine } from "./fsmkit_runtime.mjs";',
        '"lamp"(on: boolean): void;', '"weight"(): number;', '"part": [size: bigint];',
        'sent: [event: "counted", payload: [total: bigint], peer: string | null];',
        '"total": bigint;', '"last": number;', 'state: "idle" | "busy" | "done";',
        "export class Counter extends Machine<CounterShape> {",
    ):  # fmt: skip
        assert part in text, text
    assert "save(" not in text


def test_a_part_that_there_is_not(tmp_path: Path) -> None:
    with pytest.raises(FsmkitError, match="unknown-part"):
        made(COUNTER, tmp_path, "tracing")


def test_the_text_is_the_same_each_time(tmp_path: Path) -> None:
    first = made(COUNTER, tmp_path).files
    assert set(first) == FILES
    assert first == made(COUNTER, tmp_path).files


@pytest.mark.parametrize(
    ("name", "file", "wanted"),
    [
        ("Object", "object.mjs", "Object_2"),
        ("fsmkit_runtime", "machine_fsmkit_runtime.mjs", "Fsmkit_runtime"),
        ("NaN", "na_n.mjs", "NaN_2"),
    ],
)
def test_names_that_are_taken(name: str, file: str, wanted: str, tmp_path: Path) -> None:
    (tmp_path / "chart.yaml").write_text(COUNTER.replace("chart: Counter", f"chart: {name}"))
    chart = load(tmp_path / "chart.yaml")
    assert file_name(chart) == file
    assert f"export class {wanted} extends rt.Machine" in module_text(chart)


def test_what_runs_is_never_left_to_chance(tmp_path: Path) -> None:
    (tmp_path / "chart.yaml").write_text(
        "chart: Weather\ninitial: dry\n"
        "states:\n  dry: {sometimes: wet}\n  wet: {after: {1s..2s: dry}}\n"
    )
    findings = Findings()
    assert PLUGIN.generate(load(tmp_path / "chart.yaml"), findings, {}) is None
    assert [found.rule.name for found in findings] == ["javascript-sometimes"] * 2
    assert all(found.primary is not None for found in findings)
