"""Check generated C by the rules of MISRA C:2012 with Cppcheck and its addon."""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.codegen.c.generate import Machine

FOUND = re.compile(r"^misra-c2012-(\d+\.\d+) ")


@dataclass(frozen=True, slots=True)
class Lint:
    """The findings: how many deviations of each rule, and the other warnings."""

    deviations: Mapping[str, int]
    warnings: tuple[str, ...]
    failure: str = ""


def check_rules(
    cppcheck: str, machine: Machine, folder: Path, timeout: float | None = None
) -> Lint:
    """Check the sources of a machine.

    Args:
        cppcheck: The program.
        machine: The generated C.
        folder: Receives the sources.
        timeout: Seconds after which the check is ended.

    """
    for name, text in machine.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = sorted(name for name in machine.files if name.endswith(".c"))
    command = [cppcheck, "-q", "--addon=misra", "--std=c99", "-UFSM_HOOKS"]
    command += ["--enable=warning,performance,portability", "--template={id} {file}:{line}"]
    try:
        done = subprocess.run(
            [*command, *sources],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
        )
    except subprocess.TimeoutExpired:
        return Lint({}, (), f"it did not end within {timeout:g} s")
    if done.returncode:
        return Lint({}, (), f"it failed: {done.stdout[-500:]}{done.stderr[-500:]}")
    lines = sorted(set(done.stderr.splitlines()))
    rules = Counter(found[1] for line in lines if (found := FOUND.match(line)))
    others = tuple(line for line in lines if not FOUND.match(line))
    order = sorted(rules, key=lambda rule: [int(part) for part in rule.split(".")])
    return Lint({rule: rules[rule] for rule in order}, others)
