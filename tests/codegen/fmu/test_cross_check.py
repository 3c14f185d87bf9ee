"""The files of the FMI Cross-Check: by its rules, and reached by FMPy from the same inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsmkit.chart.loading import load
from tests.codegen.fmu.cross_check import COLUMNS, LARGEST, write

CELL = Path(__file__).parents[3] / "machines" / "production_cell"
CHARTS = Path(__file__).parent / "charts"
CASES = [
    ("2.0", CELL / "feeder.yaml"),
    ("2.0", CELL / "molder.yaml"),
    ("2.0", CHARTS / "thermostat.yaml"),
    ("3.0", CHARTS / "thermostat.yaml"),
    ("3.0", CHARTS / "debounce.yaml"),
    ("3.0", CELL / "feeder.yaml"),
]

pytestmark = [pytest.mark.external, pytest.mark.cc]


@pytest.mark.parametrize(("version", "chart"), CASES, ids=lambda case: getattr(case, "stem", case))
def test_fmpy_reaches_the_reference_from_the_inputs(
    version: str, chart: Path, tmp_path: Path
) -> None:
    from fmpy import read_model_description, simulate_fmu
    from fmpy.util import read_csv, read_ref_opt_file
    from fmpy.validation import validate_fmu

    folder = write(tmp_path, load(chart), version, seed=2, left_out=("fault", "estop", "stall"))
    name = folder.name
    assert sorted(path.name for path in folder.iterdir()) == [
        f"{name}.fmu", f"{name}_in.csv", f"{name}_ref.csv", f"{name}_ref.opt",
    ]  # fmt: skip
    options = read_ref_opt_file(folder / f"{name}_ref.opt")
    given, reference = (read_csv(folder / f"{name}_{which}.csv") for which in ("in", "ref"))
    file = str(folder / f"{name}.fmu")
    assert validate_fmu(file) == []
    known = {v.name: v for v in read_model_description(file).modelVariables}
    for read, most in ((given, len(known)), (reference, COLUMNS)):
        time, *names = read.dtype.names
        assert time == "time"
        assert 1 <= len(names) <= most
        assert np.all(np.diff(read["time"]) >= 0)
        assert set(names) <= known.keys()
        assert read["time"][0] == options["StartTime"]
        assert read["time"][-1] == options["StopTime"]
    assert {known[n].causality for n in given.dtype.names[1:]} == {"input"}
    assert all(path.stat().st_size <= LARGEST for path in folder.glob("*.csv"))

    result = simulate_fmu(
        file,
        start_time=options["StartTime"],
        stop_time=options["StopTime"],
        relative_tolerance=options["RelTol"],
        output_interval=options["StepSize"],
        input=given,
        output=list(reference.dtype.names[1:]),
    )
    assert len(result) == len(reference)
    for column in reference.dtype.names:
        differs = np.flatnonzero(~np.isclose(result[column], reference[column], 1e-12, 1e-9))
        assert not differs.size, (column, reference["time"][differs[:5]])
    moved = sum(len(np.unique(reference[column])) - 1 for column in reference.dtype.names[1:])
    # in 3.0 the feeder waits for events, which are Clocks
    assert moved > 10 or (version, name) == ("3.0", "Feeder")
