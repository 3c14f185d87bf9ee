"""What tests need beyond Python: the one way to skip, and the one to leave out.

A tool that is not installed skips a test, through `tool` or `need`; with FSMKIT_REQUIRE_TOOLS that
is a failure. Data, rights or a feature of the system that are not there are no fault of whoever
runs the tests: such tests are left out at collection (`where`), and counted in the summary.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

ALL_TOOLS = bool(os.environ.get("FSMKIT_REQUIRE_TOOLS"))
"""Whether all tools must be there, as where everything is tested before it lands."""
DATA = Path(
    os.environ.get("FSMKIT_CONFORMANCE", Path(__file__).parents[2] / "shared" / "conformance")
)
"""Public test data: others' charts, the W3C suite."""
NO_DATA = f"the public test data are not at {DATA}; set FSMKIT_CONFORMANCE"
DATA_FIXTURES = frozenset({"shared", "public_files"})
"""Fixtures that give folders of the public test data."""

EXTERNAL = frozenset(
    {
        *("avr-gcc", "avr-size"),
        *("arm-linux-gnueabihf-gcc", "arm-none-eabi-gcc", "arm-none-eabi-nm", "arm-none-eabi-size"),
        *("i686-linux-gnu-gcc", "powerpc-linux-gnu-gcc", "qemu-i386", "qemu-ppc"),
        *("clang", "clang++", "clang-tidy", "cmake", "cppcheck", "dot", "frama-c", "g++"),
        *("chromium", "idlc", "java", "javac"),
        *(
            "mpicc",
            "mpirun",
            "node",
            "pkg-config",
            "plantuml",
            "qemu-arm",
            "qemu-system-arm",
            "riscv64-unknown-elf-gcc",
            "riscv64-unknown-elf-size",
            "simavr",
            "spin",
            "systemd-analyze",
            "valgrind",
        ),
    }
)
"""Programs that `make tools` installs; a test that starts one is marked ``external``."""


def need(is_there: bool, name: str) -> None:
    """Skip the test where a tool is not there, or fail where all tools must be there."""
    if not is_there:
        missing = f"`{name}` is not installed (make tools)"
        if ALL_TOOLS:
            pytest.fail(missing)
        pytest.skip(missing)


def compiler() -> str | None:
    """Return the path of the C compiler, as the explorer looks for it."""
    names = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    return next((path for name in names if (path := shutil.which(name))), None)


def tool(name: str) -> str:
    """Return the path of a program; without it skip the test, or fail."""
    path = shutil.which(name)
    need(path is not None, name)
    assert path is not None
    return path


def where(condition: object, reason: str) -> pytest.MarkDecorator:
    """Return the mark of tests that are left out, and counted, unless the condition holds."""
    return pytest.mark.only_where(bool(condition), reason=reason)
