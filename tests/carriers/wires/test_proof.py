"""No undefined behaviour in the wires of a board, whatever hardware says, in any run."""

from __future__ import annotations

import random
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.carriers.wires.printing.names import names_of
from fsmkit.codegen.system.program import program_of
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read
from tests.carriers.wires.conftest import load, write
from tests.carriers.wires.random_boards import CHART, Maker

pytestmark = [pytest.mark.external, pytest.mark.slow]
ALARM = re.compile(r"^\[eva:alarm\] (.*(?:\n  .*)*)", re.MULTILINE)


def alarms(frama_c: str, folder: Path, seed: int, change: Callable[[str], str]) -> list[str]:
    """Analyse a random board without its machine; ``change``: of ``fsm_io.c``."""
    board = load(write(folder, CHART, Maker(random.Random(seed)).text()))
    names = names_of(board)
    s = names.prefix
    inputs = [names.signals[n] for n, signal in enumerate(board.signals) if signal.is_input]
    flags = [names.value(n) for n, signal in enumerate(board.signals) if signal.is_of_host]
    made = dict(program_of(board, "c", Findings(), {}).files)
    node = program_of(read(folder / "deployment.yaml", Findings()), "c", Findings(), {}).files
    made |= {name.removeprefix("a/"): text for name, text in node.items()}
    made["fsm_io.c"] = change(str(made["fsm_io.c"]))
    made["fsm_link.h"] = "typedef struct l fsm_link;\ntypedef struct m fsm_link_map;\n"
    made["main.c"] = "\n".join((
        f'#include "{s}.h"',
        "volatile int32_t any;",
        f"static {s} io;",
        f"static {s}_raw raw;",
        "/* The machine has a proof of its own. */",
        "void plant_a_init(plant_a *s) { (void)s; }",
        "bool mould_post(mould *m, const mould_event *e) { return m->in.b0 || e->event > 0u; }",
        "bool mould_in(const mould *m, mould_state state) { (void)m; (void)state; return any; }",
        "int main(void)",
        "{",
        f"    {s}_init(&io);",
        "    while (any) {",
        *(f"        raw.{name} = any;" for name in inputs),
        *(f"        {flag} = any != 0;" for flag in flags),
        f"        {s}_read(&io, &raw);",
        f"        {s}_to_machines(&io);",
        f"        {s}_from_machines(&io, &raw);",
        "    }",
        "    return 0;",
        "}",
        "",
    ))  # fmt: skip
    for name, text in made.items():
        (folder / name).write_text(str(text), encoding="utf-8")
    command = [
        *(frama_c, "-eva", "-eva-precision", "1", "-eva-auto-loop-unroll", "16"),
        *("-machdep", "gcc_x86_64", "-eva-msg-key=-final-states,-initial-state"),
        f"-cpp-extra-args=-I{folder}",
        *(str(folder / name) for name in (f"{s}.c", "fsm_io.c", "main.c")),
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert "[eva] done for function main" in done.stdout, done.stdout[-4000:]
    reached = re.search(r"statements reached \(out of \d+\): (\d+)% coverage", done.stdout)
    assert reached is not None
    assert int(reached[1]) >= 85
    return ALARM.findall(done.stdout)


@pytest.mark.parametrize("seed", range(3))
def test_no_alarm(seed: int, tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    assert alarms(require_tool("frama-c"), tmp_path, seed, lambda text: text) == []


def test_an_alarm_is_seen(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    """A filter that might leave its range."""

    def broken(text: str) -> str:
        assert "bounded(converter->filtered)" in text
        return text.replace("bounded(converter->filtered)", "converter->filtered")

    assert alarms(require_tool("frama-c"), tmp_path, 0, broken)
