"""Whether a loop hangs: the law of the watch, and C against Python."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.runtime.links.watch import Watch
from fsmkit.system.deployment.watchdog import LOOKS
from tests.runtime.links.conftest import HOSTS

MAIN = """\
#include "fsm_watch.h"
#include <inttypes.h>
#include <stdio.h>
int main(void)
{
    fsm_watch watch;
    uint64_t bound, cycles, now;
    if (scanf("%" SCNu64, &bound) != 1)
        return 1;
    fsm_watch_start(&watch, 0u, bound, 0u);
    printf("%" PRIu64 "\\n", fsm_watch_every(&watch));
    while (scanf("%" SCNu64 " %" SCNu64, &cycles, &now) == 2)
        printf("%d", fsm_watch_look(&watch, (FSM_INDEX)cycles, now));
    return 0;
}
"""


def looks(draw: random.Random, bound: int) -> list[tuple[int, int, int]]:
    """Return looks at most a quarter of the bound apart: completed cycles, now, the last cycle."""
    now = cycles = last = 0
    found = []
    next_cycle = draw.randint(1, bound)
    for _ in range(400):
        now += draw.randint(1, bound // LOOKS)
        while next_cycle <= now:
            cycles, last = cycles + 1, next_cycle
            most = bound // 2 if draw.random() < 0.98 else bound * 5
            next_cycle += draw.randint(1, most)
        found.append((cycles, now, last))
    return found


@pytest.mark.parametrize("bound", [4, 7, 20, 100, 100_000])
def test_a_hung_loop_is_never_live_and_a_working_one_always(bound: int) -> None:
    for seed in range(20):
        watch = Watch(bound, 0)
        gaps: list[int] = [0]
        before = 0
        for cycles, now, last in looks(random.Random(seed), bound):
            is_live = watch.look(cycles, now)
            if now - last >= bound:
                assert not is_live
            gaps = [*gaps[-3:], last - before] if last != before else gaps
            if max(gaps) <= bound // 2 and now - last < bound // 2:
                assert is_live
            before = last


@pytest.mark.cc
def test_c_watches_as_python_does(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    (tmp_path / "main.c").write_text(MAIN)
    command = [require_tool("gcc"), "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion"]
    command += ["-Wshadow", "-Werror", f"-I{HOSTS}", str(tmp_path / "main.c")]
    subprocess.run([*command, "-o", str(tmp_path / "main")], check=True)
    for seed, bound in enumerate((1, 4, 8, 100, 1000, 2**40)):
        found = looks(random.Random(seed), max(bound, LOOKS))
        found += [(2**32 + 5, found[-1][1] + bound // 5 + 1, 0)]  # cycles are counted modulo 2^32
        text = "\n".join([str(bound), *(f"{cycles} {now}" for cycles, now, _ in found)])
        done = subprocess.run(
            [tmp_path / "main"], input=text, capture_output=True, text=True, check=True
        )
        watch = Watch(bound, 0)
        expected = "".join(str(int(watch.look(c % 2**32, now))) for c, now, _ in found)
        assert done.stdout.split() == [str(max(bound // LOOKS, 1)), expected]
