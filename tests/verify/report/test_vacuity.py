"""Properties that hold because what they speak of never happens."""

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check

CHART = """\
chart: Lamp
data: {count: 0..3 = 0}
events: {in: [press]}
initial: dark
states:
  dark: {rest: true, on: {press: lit}}
  lit: {on: {press: dark}}
  broken: {on: {press: dark}}
"""


def findings(folder: Path, written: str) -> list[str]:
    (folder / "lamp.yaml").write_text(CHART)
    system = folder / "lamps.yaml"
    system.write_text(
        "system: Lamps\nmachines: {lamp: lamp.yaml}\nenvironment: {may: [lamp.press]}\n"
        f"properties: {{p: {{{written}}}}}\n"
    )
    found = Findings()
    check(load_any(system, found), found, options=ExplorationOptions("python", time="untimed"))
    return [one.message for one in found if one.rule.name == "vacuous-property"]


@pytest.mark.parametrize(
    ("written", "part"),
    [
        ("leads_to: [lamp.In(broken), lamp.In(dark)]", "lamp.In(broken)"),
        ("leads_to: [lamp.count == 2, lamp.In(dark)]", "lamp.count == 2"),
        ("never: lamp.In(broken) and lamp.count > 0", "lamp.In(broken)"),
        ("never: lamp.count > 0 and (lamp.In(broken) and lamp.In(lit))", "lamp.In(broken)"),
        ("invariant: not lamp.In(broken) or lamp.count == 0", "lamp.In(broken)"),
        ("invariant: not (lamp.In(broken) and lamp.count > 0)", "lamp.In(broken)"),
    ],
)
def test_a_condition_that_is_never_true_is_named(tmp_path: Path, written: str, part: str) -> None:
    assert findings(tmp_path, written) == [f"`p` holds because `{part}` is never true"]


@pytest.mark.parametrize(
    "written",
    [
        "leads_to: [lamp.In(lit), lamp.In(lit)]",
        "never: lamp.In(lit) and lamp.count > 0",  # of data nothing is known
        "never: lamp.In(broken)",  # that is the property
        "invariant: not lamp.In(lit) or lamp.count == 0",
        "reachable: lamp.In(lit)",
    ],
)
def test_other_properties_are_not_vacuous(tmp_path: Path, written: str) -> None:
    assert findings(tmp_path, written) == []
