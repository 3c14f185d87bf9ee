"""Builds an extension module on this computer, for the running Python."""

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
    """Return the suffix of an extension module: that of the stable ABI, if available."""
    if sysconfig.get_config_var("Py_GIL_DISABLED") or sys.platform == "win32":
        return str(sysconfig.get_config_var("EXT_SUFFIX"))
    return ".abi3.so"


def headers() -> list[Path]:
    """Return the folders with Python's headers; raise `FsmkitError` if they are missing."""
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
    """Return the bytes of the extension module ``name``, built from one source and its includes."""
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
    """Return the linker options for a module that resolves Python's functions when it is loaded."""
    if sys.platform == "darwin":
        return ("-bundle", "-undefined", "dynamic_lookup")
    return ("-shared",)
