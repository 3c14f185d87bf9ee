"""The interpreter restores what generated C saves, and the reverse; damaged bytes are rejected."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.runtime.session import Session
from tests.codegen.oven import OVEN

OTHER = OVEN.replace("5s: hot", "6s: hot")
HOST = """
#include "oven.h"
#include <stdio.h>
#include <string.h>
static oven m;
static bool is_nested;
void oven_alarm(oven *of)
{
    uint8_t bytes[OVEN_SAVED_BYTES];
    is_nested = !oven_save(of, 0u, bytes)
                && oven_restore(of, 0u, bytes, sizeof bytes) == FSM_IN_STEP;
}
int main(int count, char **arguments)
{
    uint8_t bytes[OVEN_SAVED_BYTES + 100] = {0};
    (void)arguments;
    oven_init(&m);
    if (count > 1) {
        size_t size = fread(bytes, 1, sizeof bytes, stdin);
        printf("%d ", (int)oven_restore(&m, 4000000000u, bytes, size));
        oven_run(&m, 4000000000u + 3999u);
        printf("%d ", oven_in(&m, OVEN_STATE_HOT));
        oven_run(&m, 4000000000u + 4000u);
        printf("%d %d %d %d %g %d", oven_in(&m, OVEN_STATE_HOT), m.data.heat, m.data.grams,
               m.data.rows[1], m.data.factor, is_nested);
        return 0;
    }
    oven_start(&m, 4294967290u);
    oven_post_go(&m, OVEN_HEAT_HIGH, -300);
    oven_run(&m, 4294967290u);
    oven_post_hint(&m);
    oven_run(&m, 4294967291u);
    oven_post_stop(&m);
    if (!oven_save(&m, 994u, bytes))
        return 1;
    fwrite(bytes, 1, OVEN_SAVED_BYTES, stdout);
    return 0;
}
"""

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


def chart_of(folder: Path, text: str) -> Chart:
    path = folder / "oven.yaml"
    path.write_text(text)
    return load(path)


@pytest.fixture
def host(tmp_path: Path, write: Write, compile_with: Compile) -> Path:
    machine = generate_machine(chart_of(tmp_path, OVEN), None, Options(extras=frozenset({"save"})))
    write(tmp_path, {**machine.files, "host.c": HOST})
    sources = ("host.c", "oven.c", "oven_info.c", "fsm_save.c", "fsm.c")
    compile_with(
        tmp_path, "gcc", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-o", "host",
        *sources,
    )  # fmt: skip
    return tmp_path / "host"


def run(host: Path, data: bytes | None = None) -> bytes:
    arguments = [] if data is None else ["restore"]
    done = subprocess.run([host, *arguments], input=data or b"", capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


@pytest.mark.cc
def test_the_interpreter_goes_on_from_what_c_saved(host: Path, tmp_path: Path) -> None:
    session = Session(chart_of(tmp_path, OVEN), {"alarm": lambda: None}, start=False)
    session.restore(run(host))
    assert session.active == ("warm",)
    assert session.data == {"heat": "high", "grams": -300, "factor": 0.1, "rows": [7, 9, 7]}
    assert session.next_deadline == 4000  # of 5 s one is gone, over the end of the clock
    assert [len(waiting) for waiting in (session.snapshot.queue, session.snapshot.deferred)] == [
        1,
        1,
    ]
    session.run()
    assert session.active == ("off",)


@pytest.mark.cc
def test_c_goes_on_from_what_the_interpreter_saved(host: Path, tmp_path: Path) -> None:
    session = Session(chart_of(tmp_path, OVEN), {"alarm": lambda: None})
    session.post("go", "high", -300)
    session.run()
    session.advance("1s")
    # restored; not hot yet; then hot; the values; rejected within the step
    assert run(host, session.save_bytes()).split() == b"0 0 1 1 -300 9 0.1 1".split()


@pytest.mark.cc
def test_what_is_damaged_or_of_another_chart_is_refused(host: Path, tmp_path: Path) -> None:
    saved = Session(chart_of(tmp_path, OVEN), {"alarm": lambda: None}).save_bytes()
    damaged = [saved[:-1], saved + b"\0", b"", saved[:9] + b"?" + saved[10:]]
    damaged.append(saved[:20] + bytes([saved[20] ^ 1]) + saved[21:])
    for data in damaged:
        assert run(host, data).split()[0] == b"1"
    foreign = Session(chart_of(tmp_path, OTHER), {"alarm": lambda: None}).save_bytes()
    assert run(host, foreign).split()[0] == b"2"


def test_nothing_is_there_unless_it_is_asked_for(tmp_path: Path) -> None:
    files = generate_machine(chart_of(tmp_path, OVEN)).files
    assert set(files) == {"oven.h", "oven.c", "fsm.h", "fsm.c"}
    assert "_save" not in files["oven.h"]
