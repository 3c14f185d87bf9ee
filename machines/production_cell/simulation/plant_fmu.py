"""Packs the plant as an FMU: ``python -m machines.production_cell.simulation.plant_fmu OUT``.

The FMU is of FMI 3.0, for co-simulation, and needs Python with numpy where it runs (pythonfmu3).
"""

# mypy: disable-error-code="import-untyped"

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import click

HERE = Path(__file__).parent
PACKAGE = Path(*(__package__ or "").split("."))
MODULES = ("axes", "blocks", "plant", "plant_process", "protocol", "signals")
"""The modules of the plant."""


def build(out: Path) -> Path:
    """Write ``CellPlant.fmu`` into a folder; return its path. Raises ImportError."""
    from pythonfmu3.builder import FmuBuilder

    with tempfile.TemporaryDirectory(prefix="plant") as folder:
        package = Path(folder) / PACKAGE
        package.mkdir(parents=True)
        (package / "__init__.py").touch()
        for name in MODULES:
            shutil.copy(HERE / f"{name}.py", package)
        top = Path(folder) / PACKAGE.parts[0]
        return Path(FmuBuilder.build_FMU(HERE / "fmu_slave.py", out, [top]))


@click.command()
@click.argument("out", type=click.Path(file_okay=False, path_type=Path))
def main(out: Path) -> None:
    """Write CellPlant.fmu into the folder OUT."""
    try:
        click.echo(build(out))
    except ImportError:
        raise click.ClickException("pythonfmu3 is missing: pip install 'fsmkit[fmi]'") from None


if __name__ == "__main__":
    main()
