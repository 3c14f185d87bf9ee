"""Invoked charts in C do what they do in the interpreter (SCXML 6.4, 6.5)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from devtools.differential import elaborated
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.invoking import random_invoking
from devtools.random_charts.scripts import random_script
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import Machine, generate_machine
from fsmkit.runtime.script import run_script
from fsmkit.testing.harness import c as harness

SHOP = Path(__file__).parents[2] / "golden/shop.yaml"
SCRIPTS = (
    ("start 0", "post go", "run 1", "dump", "post hint 3", "run 2", "run 60", "dump"),
    ("start 0", "post go", "run 1", "post stop", "run 2", "run 90", "dump"),
    ("start 7", "post go", "run 8", "post order 1", "run 9", "run 200", "start 300", "run 301"),
)
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")


@pytest.fixture(scope="module")
def shop() -> Chart:
    return load(SHOP)


@pytest.fixture(scope="module")
def machine(shop: Chart) -> Machine:
    return generate_machine(shop, "shop")


@pytest.mark.external
@pytest.mark.parametrize("script", SCRIPTS, ids=range(len(SCRIPTS)))
def test_a_shop_with_a_press_and_its_feeder(shop: Chart, script: tuple[str, ...]) -> None:
    assert harness.run_many([(shop, script)]) == [run_script(shop, script)]


@pytest.mark.slow
@pytest.mark.external
def test_random_families_under_sanitizers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(harness, "FLAGS", (*harness.FLAGS, *SANITIZERS))
    jobs = []
    for number in range(12):
        choices = SeededChoices(f"invoked in C {number}")
        chart = elaborated((random_invoking(choices),))
        jobs.append((chart, random_script(choices, chart)))
    expected = [run_script(chart, script) for chart, script in jobs]
    assert any(": @" in line for trace in expected for line in trace), "nothing ran in a slot"
    assert harness.run_many(jobs) == expected


def test_each_slot_is_a_machine_of_its_own_within_its_invoker(machine: Machine) -> None:
    header = machine.files["shop.h"]
    (struct,) = re.findall(r"typedef struct shop \{\n(.*?)\n\} shop;", header, re.DOTALL)
    inner = [name for name in machine.files if name.startswith("shop_")]
    assert {"shop_press.h", "shop_press.c", "shop_press_feeder.h"} <= set(inner), inner
    assert re.search(r"^\s*shop_press press;", struct, re.MULTILINE), struct
    assert "*" not in re.sub(r"/\*.*?\*/", "", struct, flags=re.DOTALL), "a pointer in the struct"


def test_its_size_is_told(machine: Machine) -> None:
    sizes = machine.figures
    assert 0 < sizes["slot_press_bytes"] < sizes["struct_bytes"]
    assert f"SHOP_SLOT_PRESS_BYTES {sizes['slot_press_bytes']}" in machine.files["shop.h"]
