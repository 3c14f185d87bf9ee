"""The script that proves the Production Cell, as a module."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

CELL = Path(__file__).parents[2] / "machines/production_cell"


def the_script() -> ModuleType:
    """Return the script that proves the Production Cell."""
    spec = importlib.util.spec_from_file_location("cell_verify", CELL / "verify.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
