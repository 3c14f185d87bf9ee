"""Configurations that are broken somewhere end in findings, and there and back is the same."""

from __future__ import annotations

import json
import re
from random import Random

import pytest

from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from devtools.transitions_harness import TransitionsHarness
from fsmkit.chart.elaborate import elaborate
from fsmkit.codegen.transitions.limits import check
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.foreign.pytransitions import chart_of
from fsmkit.foreign.pytransitions.plugin import PLUGIN
from fsmkit.testing.harness.harness import INTERPRETER
from tests.foreign.pytransitions.machines import random_configuration

pytestmark = pytest.mark.slow

WORDS = (
    *("null", "[", "{", "}", "]", '"a"', '"*"', '"="', "3", "true", '""', ":", ",", '"a_k"', "-1"),
    *('"initial"', '"children"', '"parallel"', '"timeout"', '"nan"', '"final"', "1e999"),
)


def broken(random: Random, text: str) -> str:
    if random.random() < 0.4:
        place = random.randrange(len(text))
        return text[:place] + random.choice('[]{}",:x\0\n&*') + text[place + random.randint(0, 3) :]
    parts = re.findall(r'"[^"]*"|[\[\]{}:,]|[\w.]+', text)
    for _ in range(random.randint(1, 3)):
        place = random.randrange(len(parts))
        if random.random() < 0.4:
            del parts[place]
        else:
            parts[place] = random.choice((*WORDS, *parts))
    return " ".join(parts)


def test_broken_configurations_end_in_findings() -> None:
    random, read = Random(5), 0
    for number in range(600):
        text = json.dumps(random_configuration(SeededChoices(f"broken {number % 60}")))
        findings = Findings()
        try:
            document = PLUGIN.read(Source("x.json", broken(random, text)), findings)
            assert document is not None or findings.has_errors
            read += document is not None and elaborate((document,), findings) is not None
        except FsmkitError:
            pass
    assert 30 < read < 570


def test_there_and_back() -> None:
    """A machine of the library, read and written again, does what its chart does."""
    written = 0
    for number in range(150):
        choices = SeededChoices(f"back {number}")
        try:
            chart = chart_of(random_configuration(choices))
        except FsmkitError:
            continue
        if check(chart, Findings()):
            written += 1
            script = random_script(choices, chart, 30)
            expected = INTERPRETER.run(chart, script)
            assert TransitionsHarness().run(chart, script) == expected
    assert written > 40
