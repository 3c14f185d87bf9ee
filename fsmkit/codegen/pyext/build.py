"""An extension module built on this machine, for the Python that runs this."""

from __future__ import annotations

import sys
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from fsmkit.codegen.c.compiler import CANDIDATES, compile_c
from fsmkit.diagnostics import fail

OPTIMIZED = ("-O2",)
COMMON = ("-fPIC", "-fvisibility=hidden", "-w")


def suffix() -> str:
    """Return how the file of an extension module ends: one for all Pythons where there can be."""
    if sysconfig.get_config_var("Py_GIL_DISABLED") or sys.platform == "win32":
        return str(sysconfig.get_config_var("EXT_SUFFIX"))
    return ".abi3.so"


def headers() -> list[Path]:
    """Return the folders with Python's headers; `FsmkitError` where there are none."""
    found = [Path(sysconfig.get_path(name)) for name in ("include", "platinclude")]
    if not (found[0] / "Python.h").is_file():
        raise fail(
            "no-python-headers",
            f"there is no `Python.h` in `{found[0]}`",
            help="install the headers of this Python (Debian: python3-dev), or write the sources "
            "alone with `--no-build`",
        )
    return list(dict.fromkeys(found))


def build(
    files: Mapping[str, str],
    source: str,
    name: str,
    flags: Sequence[str] = OPTIMIZED,
    candidates: Sequence[str] = CANDIDATES,
) -> bytes:
    """Return the extension module ``name`` that is made of one source, which includes the rest."""
    include = headers()
    made = f"{name}{suffix()}"
    with tempfile.TemporaryDirectory(prefix="fsmkit-") as folder:
        for path, text in files.items():
            (Path(folder) / path).write_text(text, encoding="utf-8")
        paths = [f"-I{path}" for path in include]
        compile_c([*flags, *COMMON, *_linking(), *paths, source, "-o", made], Path(folder),
                  candidates)  # fmt: skip
        return (Path(folder) / made).read_bytes()


def _linking() -> tuple[str, ...]:
    """Return how a module that finds Python's functions when it is loaded is linked."""
    if sys.platform == "darwin":
        return ("-bundle", "-undefined", "dynamic_lookup")
    return ("-shared",)
