"""What others make of a file that fsmkit wrote: their compilers, parsers and checkers.

Each reader takes files and returns, for those that it refuses, its first words. A reader whose tool
is not installed reads nothing, and says so by `missing`.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from tests.export import cspm_format, uppaal_format

NODE_MODULES = Path(__file__).parents[2] / "build" / "node" / "node_modules"
"""Where `make tools` puts Mermaid."""
STRICT_C = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
LONG = 300
"""Seconds for one call of a tool."""
LARGEST_DIAGRAM = 100_000
"""Bytes; the parsers of diagrams take time that grows faster than their length."""

Refusals = Mapping[Path, str]


@dataclass(frozen=True, slots=True)
class Reader:
    """A tool that reads a kind of file, and how it is called."""

    name: str
    read: Callable[[Sequence[Path]], Refusals]
    is_there: Callable[[], bool]


def _run(argv: Sequence[str], folder: Path | None = None) -> tuple[int, str]:
    try:
        done = subprocess.run(
            argv,
            check=False,
            capture_output=True,
            text=True,
            errors="replace",
            cwd=folder,
            timeout=LONG,
        )
    except subprocess.TimeoutExpired:
        return 1, f"{argv[0]} takes longer than {LONG} s"
    return done.returncode, done.stdout + done.stderr


def _each(argv: Callable[[Path], Sequence[str]]) -> Callable[[Sequence[Path]], Refusals]:
    def read(files: Sequence[Path]) -> Refusals:
        refused = {}
        for file in files:
            code, said = _run(argv(file), file.parent)
            if code:
                refused[file] = said.strip()[:300]
        return refused

    return read


def _c(file: Path) -> Sequence[str]:
    return ("cc", *STRICT_C, "-c", file.name, "-o", f"{file.stem}.o")


def _python(file: Path) -> Sequence[str]:
    check = "import sys; compile(open(sys.argv[1], encoding='utf-8').read(), sys.argv[1], 'exec')"
    return (sys.executable, "-W", "error", "-c", check, file.name)


def _promela(files: Sequence[Path]) -> Refusals:
    """`spin -a` exits with 0 for some errors: its words count."""
    refused = {}
    for file in files:
        folder = file.parent / f"{file.stem}-spin"
        folder.mkdir(exist_ok=True)
        code, said = _run(("spin", "-a", str(file)), folder)
        if code or "rror" in said or not (folder / "pan.c").is_file():
            refused[file] = said.strip()[:300]
        shutil.rmtree(folder)
    return refused


def _jani(files: Sequence[Path]) -> Refusals:
    script = (
        "import sys, stormpy\n"
        "for path in sys.argv[1:]:\n"
        "    try: stormpy.parse_jani_model(path)\n"
        "    except Exception as error: print(path, '\\t', str(error).splitlines()[0])\n"
    )
    _, said = _run((sys.executable, "-c", script, *map(str, files)))
    lines = (line.split("\t", 1) for line in said.splitlines() if "\t" in line)
    return {Path(path.strip()): words.strip() for path, words in lines}


def _has_stormpy() -> bool:
    return not _run((sys.executable, "-c", "import stormpy"))[0]


MERMAID = """\
import { JSDOM } from "jsdom";
import { readFileSync } from "node:fs";
const dom = new JSDOM("<!doctype html><body></body>");
globalThis.window = dom.window;
globalThis.document = dom.window.document;
const { default: mermaid } = await import("mermaid");
const refused = {};
for (const file of process.argv.slice(2)) {
  try { await mermaid.parse(readFileSync(file, "utf8")); }
  catch (error) { refused[file] = String(error.message || error).slice(0, 300); }
}
console.log(JSON.stringify(refused));
"""


def _mermaid(files: Sequence[Path]) -> Refusals:
    """In batches, as Node takes seconds to start; the largest, which take minutes, are left out."""
    script = NODE_MODULES.parent / "read.mjs"
    script.write_text(MERMAID)
    refused: dict[Path, str] = {}
    some = [path for path in files if path.stat().st_size <= LARGEST_DIAGRAM]
    for batch in _batches(some, 50):
        code, said = _run(("node", str(script), *map(str, batch)))
        if code:
            return dict.fromkeys(files, said.strip()[:300])
        refused |= {Path(path): words for path, words in json.loads(said).items()}
    return refused


def _plantuml(files: Sequence[Path]) -> Refusals:
    """All at once; if one is refused, which it is."""
    refused = {}
    small = [path for path in files if path.stat().st_size <= LARGEST_DIAGRAM]
    for some in _batches(small, 100):
        if _run(("plantuml", "-checkonly", *map(str, some)))[0]:
            for file in some:
                code, said = _run(("plantuml", "-checkonly", str(file)))
                if code:
                    refused[file] = said.strip()[:300]
    return refused


def _by_rules(rules: Callable[[str], Iterator[str]]) -> Callable[[Sequence[Path]], Refusals]:
    """Read files by the rules of their format, where no other tool can be installed."""

    def read(files: Sequence[Path]) -> Refusals:
        refused = {}
        for file in files:
            try:
                broken = list(rules(file.read_text(encoding="utf-8")))
            except Exception as error:  # noqa: BLE001  (not read is refused)
                broken = [str(error)]
            if broken:
                refused[file] = "; ".join(broken[:3])
        return refused

    return read


def _aut(text: str) -> Iterator[str]:
    """Aldebaran: a head that counts, then a line for each transition, its label in quotes."""
    head, *lines = text.splitlines()
    counted = re.fullmatch(r"des \((\d+), ?(\d+), ?(\d+)\)", head)
    if counted is None or int(counted[2]) != len(lines):
        yield f"the head `{head}` does not count {len(lines)} transitions"
        return
    for line in lines:
        step = re.fullmatch(r'\((\d+), ?"[^"\n]*", ?(\d+)\)', line)
        if step is None or max(int(step[1]), int(step[2])) >= int(counted[3]):
            yield f"no transition: {line[:80]}"


def _xml(files: Sequence[Path]) -> Refusals:
    refused = {}
    for file in files:
        try:
            etree.parse(file, etree.XMLParser(no_network=True))
        except etree.XMLSyntaxError as error:
            refused[file] = str(error)
    return refused


def _batches(files: Sequence[Path], size: int) -> Iterator[Sequence[Path]]:
    for start in range(0, len(files), size):
        yield files[start : start + size]


def _tool(name: str) -> Callable[[], bool]:
    return lambda: shutil.which(name) is not None


READERS: Mapping[str, Reader] = {
    "c": Reader("cc", _each(_c), _tool("cc")),
    "py": Reader("python", _each(_python), lambda: True),
    "dot": Reader("nop", _each(lambda file: ("nop", "-p", file.name)), _tool("nop")),
    "mmd": Reader("mermaid", _mermaid, (NODE_MODULES / "mermaid").is_dir),
    "puml": Reader("plantuml", _plantuml, _tool("plantuml")),
    "pml": Reader("spin", _promela, _tool("spin")),
    "jani": Reader("storm", _jani, _has_stormpy),
    "xml": Reader("rules of UPPAAL", _by_rules(uppaal_format.broken_rules), lambda: True),
    "csp": Reader("rules of CSPm", _by_rules(cspm_format.broken_rules), lambda: True),
    "aut": Reader("rules of Aldebaran", _by_rules(_aut), lambda: True),
    "svg": Reader("lxml", _xml, lambda: True),
}
"""By what a file's name ends with."""
