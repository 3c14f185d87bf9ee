"""Results kept as files: JSON for programs, Markdown for people, named by date and machine."""

from __future__ import annotations

import json
import platform
import re
from dataclasses import asdict
from pathlib import Path

from benchmarks.comparison.figures import Results
from benchmarks.comparison.report import markdown

CPU_INFO = Path("/proc/cpuinfo")


def machine_name(cpu_info: str) -> str:
    """Return the architecture and the processor, as Linux reports them."""
    found = re.search(r"^model name\s*:\s*(.+)$", cpu_info, re.MULTILINE)
    processor = found[1] if found else platform.processor()
    return " ".join(f"{platform.machine()} {processor}".split())


def this_machine() -> str:
    """Return the name of the measuring computer, without personal data."""
    return machine_name(CPU_INFO.read_text(encoding="utf-8") if CPU_INFO.is_file() else "")


def slug(text: str) -> str:
    """Return a text as a part of a file's name."""
    plain = re.sub(r"\((?:r|tm)\)", "", text.lower())
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")


def save(results: Results, folder: Path) -> list[Path]:
    """Write a run to a folder; a second run of a day on a machine replaces the first."""
    folder.mkdir(parents=True, exist_ok=True)
    stem = f"{results.date}-{slug(results.machine)}"
    texts = {".json": json.dumps(asdict(results), indent=1) + "\n", ".md": markdown(results)}
    for suffix, text in texts.items():
        (folder / f"{stem}{suffix}").write_text(text, encoding="utf-8")
    return [folder / f"{stem}{suffix}" for suffix in texts]
