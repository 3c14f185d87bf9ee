"""The reference of generated C shows what is generated."""

from __future__ import annotations

import re
from pathlib import Path

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import PARTS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/reference/c.md").read_text(encoding="utf-8")


def test_the_code_is_that_of_the_feeder() -> None:
    files = generate_machine(load(ROOT / "machines/production_cell/feeder.yaml")).files
    source = files["feeder.h"] + files["feeder.c"]
    blocks = re.findall(r"```c\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 4
    for block in blocks:
        assert block in source


def test_every_part_that_can_be_left_out_is_told() -> None:
    assert set(re.findall(r"^\| `(\w+)` \| (?:The|`)", PAGE, re.MULTILINE)) == set(PARTS)
