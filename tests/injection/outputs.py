"""Every output of fsmkit, made as people make it, and the judges that read what was written."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from fsmkit.cli import execute as command_line
from fsmkit.diagnostics import Findings
from fsmkit.loading import load
from fsmkit.testing.endurance.program import program, report_limits
from tests.injection.payloads import CANARY

C_FLAGS = (
    *("-fsyntax-only", "-std=c99", "-Wall", "-Wextra", "-Wpedantic"),
    *("-Wcomment", "-Wtrigraphs", "-Werror"),
)
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


@dataclass(frozen=True, slots=True)
class Output:
    """A command (``OUT`` is a folder), and what reads what it wrote."""

    name: str
    arguments: tuple[str, ...]
    judge: Callable[[Made], None]
    shapes: tuple[str, ...]
    is_quick: bool = True


def made(output: Output, file: Path, folder: Path) -> Made:
    """Run the command on a file."""
    folder.mkdir()
    words = [w.replace("FILE", str(file)).replace("OUT", str(folder)) for w in output.arguments]
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        code = command_line(words)
    return Made(code, out.getvalue(), errors.getvalue(), folder)


def judge(output: Output, file: Path, folder: Path) -> bool:
    """Whether anything was written; fails if it is wrong, and where fsmkit breaks."""
    if not output.arguments:
        return endures(file, folder)
    found = made(output, file, folder)
    assert found.code in (0, 1), f"exit code {found.code}: {found.errors[-2000:]}"
    assert "Traceback" not in found.errors, found.errors
    if found.code == 1 and output.arguments[0] != "check":
        assert found.errors.strip(), "refused without a finding"
        return False
    output.judge(found)
    return True


# --- judges --------------------------------------------------------------------------------------


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


def is_json(made: Made) -> None:
    """One JSON document, and nothing else, was printed."""
    json.loads(made.printed)


def is_text(made: Made) -> None:
    """Nothing a terminal would obey was printed."""
    found = re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", made.printed)
    assert found is None, made.printed[max(0, found.start() - 100) : found.end() + 50]


def is_dot(made: Made) -> None:
    """Graphviz reads it, and the labels make no link."""
    for path in written(made, ".dot"):
        canonical = LABEL.sub("", asked(["dot", "-Tcanon", str(path)]))
        assert not re.search(r"<img|<script|\bURL=|\bhref=", canonical, re.IGNORECASE)


def is_svg(made: Made) -> None:
    """It is XML without links and scripts."""
    for path in written(made, ".svg"):
        for element in etree.fromstring(path.read_bytes()).iter():
            tag = etree.QName(element).localname if isinstance(element.tag, str) else ""
            assert tag not in ("script", "image", "foreignObject"), tag
            assert not any("href" in name for name in element.attrib), element.attrib


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
    """SPIN makes a verifier of it."""
    for path in written(made, ".pml"):
        no_code(path.read_text(encoding="utf-8"))
        assert "Error" not in asked(["spin", "-a", path.name], path.parent)


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
    """The result is JSON; what was saved is right."""
    json.loads(made.printed)
    for path in written(made, ".py"):
        python_without_calls(path.read_text(encoding="utf-8"))
    for path in written(made, ".c"):
        no_code(path.read_text(encoding="utf-8"))
    is_drawn(made)


def is_linked(made: Made) -> None:
    """A deployment: C of every node has no code of a text, and the map is JSON."""
    for path in written(made, ".c", ".h"):
        no_code(path.read_text(encoding="utf-8"))
    for path in written(made, ".json"):
        json.loads(path.read_text(encoding="utf-8"))


CHARTS = ("yaml", "scxml", "invoking")
CLOSED = (*CHARTS, "system")
WRITTEN = ("yaml", "scxml")
DRAWN = [word for end in ("svg", "mmd", "puml") for word in ("--draw", f"OUT/d.{end}")]
TESTED = [word for end in ("c", "py") for word in ("--save-test", f"OUT/t.{end}")]


def _compile(name: str, *more: str) -> tuple[str, ...]:
    return ("compile", "FILE", "--target", name, "--out", "OUT", *more)


def _export(kind: str, end: str) -> tuple[str, ...]:
    bounded = ("--most", "20000", "--timeout", "10s")
    return ("export", "FILE", "--to", kind, "--out", f"OUT/x.{end}", *bounded)


def _check(*more: str) -> tuple[str, ...]:
    return ("check", "FILE", "--timeout", "20s", *more)


def _convert(kind: str) -> tuple[str, ...]:
    return ("convert", "FILE", "--to", kind, "--out", f"OUT/x.{kind}")


OUTPUTS = (
    Output("c", _compile("c"), is_c, CHARTS),
    Output("c with all", _compile("c", "--with", "save,trace"), is_c, CHARTS),
    Output("c size", _compile("c", "--optimize", "size"), is_c, CHARTS),
    Output("c of a system", ("compile", "FILE", "--out", "OUT"), is_c, ("system",)),
    Output("deployment", ("compile", "FILE", "--out", "OUT"), is_linked, ("deployment",)),
    Output("python", _compile("python"), runs, CHARTS),
    Output("python with all", _compile("python", "--trace", "--with", "save"), runs, CHARTS),
    Output("pyext", _compile("pyext", "--no-build"), is_extension, CHARTS),
    Output("transitions", _compile("transitions"), runs, (*CHARTS, "plain")),
    *(
        Output(f"draw {end}", ("draw", "FILE", "--out", f"OUT/x.{end}"), is_drawn, CHARTS)
        for end in ("dot", "svg", "mmd", "puml")
    ),
    Output("aut", _export("aut", "aut"), is_aut, CLOSED),
    Output("cspm", _export("cspm", "csp"), is_cspm, CLOSED),
    Output("export dot", _export("dot", "dot"), is_dot, CLOSED),
    Output("jani", _export("jani", "jani"), is_jani, CLOSED),
    Output("promela", _export("promela", "pml"), is_promela, CLOSED),
    Output("uppaal", _export("uppaal", "xml"), is_uppaal, CLOSED),
    Output("uppaal flat", _export("uppaal-flat", "xml"), is_uppaal, CLOSED),
    Output("to scxml", _convert("scxml"), is_chart, WRITTEN),
    Output("to yaml", _convert("yaml"), is_chart, WRITTEN),
    Output("show", ("show", "FILE"), is_text, CLOSED),
    Output("show json", ("show", "FILE", "--json"), is_json, CLOSED),
    Output("run", ("run", "FILE", "--events", "go; wait 2s"), is_text, CHARTS),
    Output("run json", ("run", "FILE", "--events", "go; wait 2s", "--json"), is_json, CHARTS),
    Output("sarif", ("--sarif", "OUT/x.sarif", "show", "FILE"), is_sarif, CLOSED),
    Output(
        "check", _check("--json", "--save-trace", "OUT/t", *DRAWN, *TESTED), is_checked, CLOSED,
        is_quick=False,
    ),
    Output("check text", _check("--time", "untimed"), is_text, CLOSED, is_quick=False),
    Output("cover", _check("--json", "--cover", "OUT/c"), is_checked, WRITTEN, is_quick=False),
    Output("endurance", (), is_c, CHARTS),
)  # fmt: skip


def endures(file: Path, folder: Path) -> bool:
    """Write the program of endurance; whether it can be."""
    chart, findings = load(file), Findings()
    report_limits(chart, findings)
    if findings.has_errors:
        return False
    folder.mkdir()
    for name, text in program(chart).items():
        no_code(text)
        (folder / name).write_text(text, encoding="utf-8")
    return True
