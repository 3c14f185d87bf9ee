"""The judges that read what fsmkit wrote: compilers, tools, and grammars of what is ours."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

from lxml import etree

import fsmkit
from fsmkit.chart.loading import load
from fsmkit.cli.tools.paths import PATHS
from tests.injection.payloads import CANARY

C_FLAGS = (
    *("-fsyntax-only", "-std=c99", "-Wall", "-Wextra", "-Wpedantic"),
    *("-Wcomment", "-Wtrigraphs", "-Werror"),
)
LIBRARY = Path(fsmkit.__file__).parent / "runtime" / "c"
LINKS = tuple(f"-I{PATHS[name]}" for name in ("links", "hosts", "can", "ros", "wires"))
CODE = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:[^\"\\\n]|\\.)*\"|'(?:[^'\\\n]|\\.)+'", re.DOTALL)
"""Comments and strings of C, whichever begins first."""
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'')
LABEL = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
"""A string of DOT, which may go on in the next line."""
FOREIGN = re.compile(rf"\b({CANARY}|creat|constructor|system|touch|c_code)\b")
"""What no code of ours holds, and every payload that does something."""


@dataclass(frozen=True, slots=True)
class Made:
    """What one command did: its exit code, what it printed, the folder that it wrote to."""

    code: int
    printed: str
    errors: str
    folder: Path


class Refused(Exception):  # noqa: N818 - no error of the grid
    """Nothing was written: the output cannot express the chart."""


def written(made: Made, *suffixes: str) -> Iterator[Path]:
    """Yield the files of some kinds."""
    return (p for p in sorted(made.folder.rglob("*")) if p.suffix in suffixes and p.is_file())


def is_c(made: Made) -> None:
    """Every file compiles without a warning, and holds no code of a text."""
    files = list(written(made, ".c"))
    assert files, made.printed
    includes = {str(p.parent) for p in written(made, ".h")}
    compiled([str(p) for p in files], [f"-I{folder}" for folder in sorted(includes)])
    for path in (*files, *written(made, ".h")):
        no_code(path.read_text(encoding="utf-8"))


def is_recorded(made: Made) -> None:
    """Also where it is recorded, at both levels."""
    is_c(made)
    files = [str(path) for path in written(made, ".c") if path.stem.endswith("_records")]
    assert len(files) > 1, made.printed
    includes = sorted({f"-I{Path(path).parent}" for path in files})
    for level in (1, 2):
        compiled(files, [*includes, f"-DFSM_TRACE_LEVEL={level}"])


def compiled(files: list[str], more: list[str], flags: tuple[str, ...] = C_FLAGS) -> None:
    """Ask the compiler."""
    asked(["gcc", *flags, *more, *files])


def asked(command: list[str], folder: Path | None = None) -> str:
    """Return what another tool says of what was written, which it must accept."""
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, timeout=120, cwd=folder
    )
    assert done.returncode == 0, (done.stderr + done.stdout)[:3000]
    return done.stdout


def no_code(text: str) -> None:
    """Nothing of a payload stands outside of comments and strings in C."""
    bare = CODE.sub(" ", text)
    found = FOREIGN.search(bare)
    assert found is None, bare[max(0, found.start() - 200) : found.end() + 200]


def is_extension(made: Made) -> None:
    """The wrapper compiles, the stub is Python."""
    (source,) = written(made, ".c") if len(list(written(made, ".c"))) == 1 else [
        next(p for p in written(made, ".c") if p.name.endswith("_python.c"))
    ]  # fmt: skip
    python = sysconfig.get_path("include")
    flags = ("-fsyntax-only", "-O1", "-Wall", "-Wextra", "-Wcomment", "-Wtrigraphs", "-Werror")
    compiled([str(source)], [f"-isystem{python}"], flags)
    for path in written(made, ".c", ".h"):
        no_code(path.read_text(encoding="utf-8"))
    for path in written(made, ".pyi"):
        python_without_calls(path.read_text(encoding="utf-8"))


def is_package(made: Made) -> None:
    """The manifests and the example hold no text of a chart."""
    for path in written(made, ".c", ".h", ".txt", ".yml"):
        no_code(path.read_text(encoding="utf-8"))


def is_fmu(made: Made) -> None:
    """The archive is of one folder, its descriptions are XML, its sources compile."""
    (file,) = written(made, ".fmu")
    inside = made.folder / "fmu"
    with zipfile.ZipFile(file) as archive:
        assert all(re.fullmatch(r"[\w./]+", name) for name in archive.namelist())
        archive.extractall(inside)
    for path in inside.rglob("*.xml"):
        etree.parse(path)
    sources = sorted(map(str, inside.glob("sources/*.c")))
    compiled(sources, [], ("-std=c99", "-Wall", "-Wextra", "-Wcomment", "-Werror", "-fsyntax-only"))
    for path in inside.glob("sources/*.[ch]"):
        no_code(path.read_text(encoding="utf-8"))


def is_python(made: Made) -> None:
    """Every module is Python, calls nothing of a text, and can be executed."""
    files = list(written(made, ".py"))
    assert files, made.printed
    for path in files:
        python_without_calls(path.read_text(encoding="utf-8"))


def python_without_calls(text: str) -> None:
    """Parse a module; no name of a payload is code."""
    for node in ast.walk(ast.parse(text)):
        name = node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")
        assert name not in ("__import__", "system", "eval", CANARY), ast.dump(node)
    compile(text, "made.py", "exec")


def runs(made: Made) -> None:
    """As `is_python`, and the modules are executed."""
    is_python(made)
    for path in written(made, ".py"):
        code = "import runpy, sys; sys.path.insert(0, '.'); runpy.run_path(sys.argv[1])"
        asked([sys.executable, "-c", code, path.name], path.parent)


TYPED = ("--noEmit", "--strict", "--module", "nodenext", "--target", "es2020")
IMPORTS = """
const machines = await import(process.argv[1]);
for (const Machine of Object.values(machines)) {
  new Machine(new Proxy({}, { get: () => () => 0 }));
}
"""
"""Imports a module and makes its machines."""


def is_javascript(made: Made) -> None:
    """Every module is imported, holds no code of a text, and makes a machine."""
    files = [p for p in written(made, ".mjs") if not p.name.startswith("fsmkit_")]
    assert files, made.printed
    for path in files:
        text = path.read_text(encoding="utf-8")
        assert text.isascii() or not set(text) & set("\u2028\u2029")
        assert "</script" not in text.lower()
        no_code(text.replace("  constructor(host) {", ""))
        asked(["node", "--input-type=module", "-e", IMPORTS, str(path)], path.parent)
        types = path.with_suffix(".d.mts")
        no_code(types.read_text(encoding="utf-8").replace("  constructor(host", ""))
        if shutil.which("tsc"):
            asked(["tsc", *TYPED, types.name], path.parent)


SIMULATED = """
const { readFileSync } = require("node:fs");
const text = readFileSync(process.argv[1], "utf8");
const here = text.slice(0, text.indexOf("const transport = "));
const offline = new Function(here + "return offline;")();
const hub = new offline.Hub(offline.description);
hub.join(() => {});
for (const m of hub.names) hub.receive({ id: 1, do: "events", m });
for (let count = 0; count < 20; count += 1) hub.receive({ id: 1, do: "step", how: "timer" });
for (const as of ["script", "pytest", "live"]) hub.receive({ id: 1, do: "save", as });
"""
"""Runs the script of a page, up to what needs a browser."""


class Elements(HTMLParser):
    """The elements of a page and the text of its script."""

    def __init__(self) -> None:
        super().__init__()
        self.names: Counter[str] = Counter()
        self.script = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names[tag] += 1
        assert not any(name.startswith("on") for name, _ in attrs), (tag, attrs)

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script":
            self.script += data


def is_page(made: Made) -> None:
    """The page has one script, whose hash the policy names, and no element of a text; it runs."""
    for path in written(made, ".html"):
        text = path.read_text(encoding="utf-8")
        found = Elements()
        found.feed(text)
        assert (found.names["script"], found.names["style"], found.names["img"]) == (1, 1, 0)
        assert not set(found.names) & {"iframe", "object", "embed", "link", "base", "svg"}
        digest = b64encode(sha256(found.script.encode()).digest()).decode()
        assert f"script-src 'sha256-{digest}'" in text
        (path.parent / "script.js").write_text(found.script, encoding="utf-8")
        asked(["node", "-e", SIMULATED, str(path.parent / "script.js")], path.parent)


def is_json(made: Made) -> None:
    """One JSON document, and nothing else, was printed."""
    json.loads(made.printed)


def is_text(made: Made) -> None:
    """Nothing a terminal would obey was printed."""
    found = re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", made.printed)
    assert found is None, made.printed[max(0, found.start() - 100) : found.end() + 50]


OWN_LINK = r"#t\d+"
"""A text in a state is a transition: Graphviz gives its place only to a link, here to itself."""


def is_dot(made: Made) -> None:
    """Graphviz reads it, and the labels make no link but those within the drawing."""
    for path in written(made, ".dot"):
        canonical = re.sub(rf'\bhref="{OWN_LINK}"', "", asked(["dot", "-Tcanon", str(path)]))
        canonical = LABEL.sub("", canonical)
        assert not re.search(r"<img|<script|\bURL=|\bhref=", canonical, re.IGNORECASE)


def is_svg(made: Made) -> None:
    """It is XML without scripts, whose links stay within the drawing."""
    for path in written(made, ".svg"):
        for element in etree.fromstring(path.read_bytes()).iter():
            tag = etree.QName(element).localname if isinstance(element.tag, str) else ""
            assert tag not in ("script", "image", "foreignObject"), tag
            links = [value for name, value in element.attrib.items() if "href" in name]
            assert all(re.fullmatch(OWN_LINK, str(link)) for link in links), links


MERMAID = re.compile(
    r'---|title: ".*"|stateDiagram-v2|direction TB|sequenceDiagram|title .*|actor outside|end note|'
    r'end|\}|state ".*" as s\d+( \{)?|state \w+ <<(choice|fork)>>|s\d+ : .*|'
    r"(s\d+|fork_\d+|\[\*\]) --> "
    r"(s\d+|fork_\d+|\[\*\])( : .*)?|--|classDef .*|class [s\d,]+ (active|inherited|history)|"
    r"note right of s\d+|participant m\d+ as .*|loop .*|Note over m\d+(,m\d+)?: .*|"
    r"(outside|m\d+)(->>|-->>|-\)|--\)|--x)(outside|m\d+): .*"
)


def is_mermaid(made: Made) -> None:
    """Every line is one of ours: no text begins one, ends a block, or gives a directive."""
    for path in written(made, ".mmd"):
        text = path.read_text(encoding="utf-8")
        in_note = False
        for line in text.split("\n"):
            plain = line.strip()
            assert not re.search(r"[\r\x0b\x0c\x1c-\x1e\x85\u2028\u2029]", line), line
            assert "%%" not in plain
            assert "<script" not in plain
            if not (in_note and plain != "end note") and plain:
                assert MERMAID.fullmatch(plain), plain
            in_note = plain.startswith("note right") or (in_note and plain != "end note")


def is_plantuml(made: Made) -> None:
    """One diagram, no directive in it."""
    for path in written(made, ".puml"):
        lines = path.read_text(encoding="utf-8").splitlines()
        assert lines[0].startswith("@startuml")
        assert lines[-1] == "@enduml"
        for line in lines[1:-1]:
            assert not line.lstrip().startswith(("@", "!")), line
            assert not re.search(r"%\w+\(", line), line


def is_drawn(made: Made) -> None:
    """Whatever was drawn is right."""
    for one in (is_dot, is_svg, is_mermaid, is_plantuml):
        one(made)


def is_uppaal(made: Made) -> None:
    """XML in which a declaration holds only lines of ours."""
    for path in written(made, ".xml"):
        root = etree.fromstring(path.read_bytes())
        assert root.tag == "nta"
        for element in root.iter("declaration", "system"):
            text = element.text or ""
            for line in text.split("\n"):
                code = line.partition("//")[0]
                assert "/*" not in code
                assert not FOREIGN.search(STRING.sub("", code).replace("system ", "")), line
            assert not re.search(r"[\r\x0b\x0c\x85\u2028\u2029]", text)
        for label in root.iter("label"):
            if label.get("kind") != "comments":
                assert not FOREIGN.search(label.text or ""), label.text


def is_promela(made: Made) -> None:
    """SPIN makes a verifier of it, which compiles."""
    for path in written(made, ".pml"):
        no_code(path.read_text(encoding="utf-8"))
        assert "Error" not in asked(["spin", "-a", path.name], path.parent)
        asked(["gcc", "-w", "-fsyntax-only", "pan.c"], path.parent)


def is_aut(made: Made) -> None:
    """A head, then one transition a line (Aldebaran's format, CADP)."""
    for path in written(made, ".aut"):
        head, *lines = path.read_text(encoding="utf-8").rstrip("\n").split("\n")
        match = re.fullmatch(r"des \((\d+), ?(\d+), ?(\d+)\)", head)
        assert match, head
        assert len(lines) == int(match[2])
        for line in lines:
            assert re.fullmatch(r'\(\d+, ?"[^"\x00-\x1f\x7f\x85\u2028\u2029]*", ?\d+\)', line), line


def is_jani(made: Made) -> None:
    """JSON."""
    for path in written(made, ".jani"):
        assert "automata" in json.loads(path.read_text(encoding="utf-8"))


def is_cspm(made: Made) -> None:
    """No line of a text outside of comments."""
    for path in written(made, ".csp"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"[\r\x0b\x0c\x85\u2028\u2029]", text)
        for line in text.split("\n"):
            code = STRING.sub("", line.partition("--")[0])
            assert not re.search(r"\binclude\b|\{-|-\}|[\"'`;]", code), line


def is_chart(made: Made) -> None:
    """It is read again as the same chart."""
    for path in written(made, ".yaml", ".scxml"):
        load(path)


def is_sarif(made: Made) -> None:
    """JSON."""
    for path in written(made, ".sarif"):
        assert json.loads(path.read_text(encoding="utf-8"))["version"] == "2.1.0"


def is_checked(made: Made) -> None:
    """The result is JSON; what was saved of the trap, which each chart has, is right."""
    json.loads(made.printed)
    for path in written(made, ".py"):
        python_without_calls(path.read_text(encoding="utf-8"))
    is_drawn(made)
    if not list(written(made, ".py")):
        raise Refused


def is_tested(made: Made) -> None:
    """A test in C does, with the generated C, in every step what the explorer did."""
    tests = [path for path in written(made, ".c") if path.parent.name != "m"]
    if not tests:
        raise Refused
    machines = made.folder / "m"
    program = str(made.folder / "program")
    for path in tests:
        no_code(path.read_text(encoding="utf-8"))
        sources = [str(p) for p in machines.glob("*.c")]
        asked(["gcc", "-w", "-O0", f"-I{machines}", str(path), *sources, "-o", program])
        asked([program])


def is_linked(made: Made) -> None:
    """A deployment: the C of every node compiles, has no code of a text, and the map is JSON."""
    for path in written(made, ".json"):
        json.loads(path.read_text(encoding="utf-8"))
    for folder in sorted({path.parent for path in written(made, ".c")}):
        files = sorted(folder.glob("*.c"))
        compiled([str(p) for p in files], [f"-I{folder}", *LINKS])
        for path in (*files, *folder.glob("*.h")):
            no_code(path.read_text(encoding="utf-8"))
