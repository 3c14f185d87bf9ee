"""The Production Cell from source to verdict: compile, run, check, draw.

``make demo`` runs it; what it makes is in ``build/demo``. Exit code 0: everything that could be
shown holds; 1: something does not.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

import fsmkit
from fsmkit.chart.drawing.drawing import Drawing
from fsmkit.cli.common.writing import write_files
from fsmkit.codegen.target import Target
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.language.units import duration_text
from fsmkit.plugins import plugin
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.testgen.save import saved

CELL = Path(__file__).resolve().parent
ROOT = CELL.parents[1]
OUT = ROOT / "build" / "demo"
CHARTS = ("feeder", "molder", "plant")
SECONDS = 60
"""Seconds of simulated time in the loops."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
HOLDS, FAILS, MISSING = "[green]yes[/]", "[bold red]NO[/]", "[yellow]not shown[/]"

console = Console(highlight=False, width=None if sys.stdout.isatty() else 100)


@dataclass
class Summary:
    """The results of the demo: a title for each line, whether it holds, and figures."""

    rows: list[tuple[str, str, str]] = field(default_factory=list)

    def add(self, what: str, holds: bool, figures: str) -> None:
        """Add what holds, or does not."""
        self.rows.append((what, HOLDS if holds else FAILS, figures))

    def miss(self, what: str, why: str) -> None:
        """Add what could not be shown."""
        self.rows.append((what, MISSING, why))

    @property
    def exit_code(self) -> int:
        """0 if nothing failed."""
        return int(any(result == FAILS for _, result, _ in self.rows))


def main() -> int:
    """Show everything, then sum up."""
    summary = Summary()
    shutil.rmtree(OUT, ignore_errors=True)
    steps: tuple[tuple[str, Callable[[Summary], None]], ...] = (
        ("Compile the three charts to C and Python", compile_charts),
        (f"Run feeder and molder for {SECONDS} simulated seconds, in C and in Python", run_loops),
        ("Explore each chart alone: can it get stuck in any environment?", check_charts),
        ("Explore the cell: feeder, molder and plant, with all their interleavings", check_cell),
        ("Put mistakes in, and see that they are found", check_defects),
        ("Draw the charts", draw),
    )
    for number, (title, step) in enumerate(steps, 1):
        console.print(f"\n[bold]{number}  {title}[/]")
        try:
            step(summary)
        except (FsmkitError, OSError) as error:
            console.print(Text(str(error)))
            summary.add(title, False, "see above")
        except subprocess.CalledProcessError as error:
            console.print(Text(f"{' '.join(map(str, error.cmd))}\n{error.stderr}"))
            summary.add(title, False, "see above")
    console.print("\n[bold]What was shown[/]")
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for row in summary.rows:
        table.add_row(*row)
    console.print(table)
    console.print(f"\nEverything made is in [bold]{shown(OUT)}[/].")
    return summary.exit_code


# --- compile -------------------------------------------------------------------------------------


def compile_charts(summary: Summary) -> None:
    """Write the machines in C and in Python."""
    table = new_table("chart", "made from", "states", "transitions", "C", "RAM", "Python")
    total = 0
    for name in CHARTS:
        chart = fsmkit.read_chart(CELL / f"{name}.yaml")
        sizes, struct = {}, 0
        for language in ("c", "python"):
            made = plugin(Target, language).generate(chart, Findings(), {})
            if made is None:
                summary.add(f"{name} in {language}", False, "cannot be generated")
                continue
            write(OUT / "generated" / language, made.files)
            own = [text for path, text in made.files.items() if not path.startswith("fsm.")]
            sizes[language] = sum(text.count("\n") for text in own)
            struct = made.figures.get("struct_bytes", struct)
            total += len(made.files)
        base = "module.scxml, " if name != "plant" else ""
        table.add_row(
            name,
            f"{base}{name}.yaml",
            str(len(chart.states) - 1),
            str(len(chart.transitions)),
            f"{sizes.get('c', 0):,} lines",
            f"{struct} bytes",
            f"{sizes.get('python', 0):,} lines",
        )
    console.print(table)
    summary.add("three charts compiled to C and Python", total > 0, shown(OUT / "generated"))


# --- run -----------------------------------------------------------------------------------------


def run_loops(summary: Summary) -> None:
    """Run the same machines in the C loop and in the Python loop, and compare what they print."""
    what = f"C and Python loops alike for {SECONDS} s"
    environment = {**os.environ, "PYTHONPATH": str(OUT / "generated" / "python")}
    python = [sys.executable, str(CELL / "controller" / "loop.py"), str(SECONDS)]
    in_python, python_time = timed(python, environment)
    traces = OUT / "traces"
    write(traces, {"loop_python.txt": in_python})
    blocks = in_python.splitlines()[-1].split()[2]
    cc = compiler()
    if cc is None:
        summary.miss(what, "no C compiler: install `cc`, or name one in CC")
        console.print(f"in Python: {blocks} blocks moulded in {python_time:.1f} s")
        return
    generated = OUT / "generated" / "c"
    program = OUT / "loop"
    sources = [CELL / "controller" / "loop.c", CELL / "controller" / "axis.c"]
    sources += [generated / f"{name}.c" for name in ("feeder", "molder", "fsm")]
    command = [
        cc,
        "-std=c99",
        "-O2",
        *WARNINGS,
        f"-I{generated}",
        *map(str, sources),
        "-o",
        str(program),
    ]
    subprocess.run(command, check=True, capture_output=True, text=True)
    in_c, c_time = timed([str(program), str(SECONDS)])
    write(traces, {"loop_c.txt": in_c})
    lines = in_c.count("\n")
    table = new_table("loop", "lines printed", "blocks moulded", "took")
    table.add_row("C", str(lines), in_c.splitlines()[-1].split()[2], f"{c_time:.3f} s")
    table.add_row("Python", str(in_python.count("\n")), blocks, f"{python_time:.3f} s")
    console.print(table)
    console.print(
        "on the way: a pause at 20 s, a stop at 30 s, an emergency stop at 40 s; it ends:"
    )
    for line in (*in_c.splitlines()[-4:],):
        console.print(Text(f"  {line}", "dim"))
    figures = f"{lines} lines, {blocks} blocks moulded"
    summary.add(what, in_c == in_python, figures)


def timed(command: list[str], environment: Mapping[str, str] | None = None) -> tuple[str, float]:
    """Return what a program prints, and the seconds it takes."""
    began = time.monotonic()
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return done.stdout, time.monotonic() - began


# --- check ---------------------------------------------------------------------------------------


def check_charts(summary: Summary) -> None:
    """Explore each chart in an unrestricted environment."""
    what = "no chart alone gets stuck"
    if compiler() is None:
        summary.miss(what, "no C compiler, and in Python it takes too long")
        return
    table = exploration_table("chart", "no traps", "no livelock")
    holds, states = True, []
    for name in CHARTS:
        with working(f"exploring {name}"):
            report = fsmkit.check(CELL / f"{name}.yaml", time="discrete")
        table.add_row(name, *verdicts(report, "trap", "livelock"), *figures(report))
        holds &= report.verdict is fsmkit.Verdict.HOLDS
        states.append(f"{report.exploration.states:,}")
    console.print(table)
    summary.add(what, holds, f"{', '.join(states)} states")


def check_cell(summary: Summary) -> None:
    """Explore the system, in the generated C and again in the reference interpreter."""
    table = exploration_table("explored in", "P2", "D", "produces")
    counts = []
    for engine, name in (("c", "generated C"), ("python", "interpreter")):
        if engine == "c" and compiler() is None:
            summary.miss("the cell explored in generated C", "no C compiler")
            continue
        with working(f"exploring the cell in {name}"):
            report = fsmkit.check(CELL / "cell.yaml", engine=engine, time="discrete")
        table.add_row(name, *verdicts(report, "P2", "D", "produces"), *figures(report))
        found = report.exploration
        counts.append((found.states, found.transitions, found.depth))
        for key, meaning in (
            ("P2", "P2: feeder forward only if the door is closed"),
            ("D", "D: the cell never deadlocks"),
        ):
            if len(counts) == 1:
                summary.add(meaning, is_holding(report, key), f"all {found.states:,} states")
    console.print(table)
    console.print(
        "P2: never is the feeder forward while the door is not closed. D: no deadlock.\n"
        "produces: a block waits while the one before is taken out.\n"
        "Pauses, stops and emergency stops may come at any time."
    )
    if len(counts) == 2:
        same = " and ".join(f"{states:,}" for states, _, _ in counts)
        summary.add("both explorers find the same", counts[0] == counts[1], f"{same} states")


def check_defects(summary: Summary) -> None:
    """Replace the feeder by a wrong one."""
    manners = (
        ("m5", "M5, `mold_ready` is ignored", "P2", False),
        ("m2", "M2, an early `mold_ready` is lost", "D", True),
    )
    for name, meaning, key, untimed in manners:
        chart = CELL / "defects" / f"{name}_feeder.yaml"
        system = fsmkit.read_system(CELL / "cell.yaml", replace={"feeder": chart})
        with working(f"looking for what {name.upper()} breaks"):
            report = fsmkit.check(
                system,
                properties=(key,),
                time="untimed" if untimed else "discrete",
                assume_watchdogs_silent=untimed,
            )
        write_files(saved(report, CELL / "cell.yaml", OUT / "traces" / name))
        result = next(one for one in report.results if one.name == key)
        found = result.verdict is fsmkit.Verdict.VIOLATED and result.trace is not None
        console.print(f"{meaning}:", end=" ")
        console.print(f"{key} is violated" if found else f"[bold red]{key} HOLDS[/]", end="")
        steps = ""
        if result.trace is not None:
            steps = f"{len(result.trace.steps)} steps"
            told = " and in ".join(result.trace.replayed)
            console.print(f", in no less than {steps};")
            console.print(f"performed again in {told}. It ends:")
            for line in ending(result.trace.steps):
                console.print(Text(f"  {line}", "dim"))
        if untimed:
            console.print("(untimed: timers fire at any time; watchdogs are assumed silent)")
        figures = f"{key} violated in {steps}, see {shown(OUT / 'traces' / name)}"
        summary.add(f"found: {meaning}", found, figures if found else f"{key} holds")


def ending(steps: tuple[object, ...], most: int = 9) -> Iterator[str]:
    """Yield the last steps in which something moved, a line each."""
    lines = []
    for step in steps:
        machine, cause = getattr(step, "machine", ""), getattr(step, "cause", "")
        before, after = getattr(step, "before", ()), getattr(step, "after", ())
        entered = [state for state in after if state not in before]
        if machine in ("", "plant") and not entered:
            continue  # time passes, or the plant only takes note
        at = getattr(step, "at", None)
        when = f"{duration_text(at):>6}  " if at is not None else ""
        goes = f" -> {', '.join(entered)}" if entered else ""
        lines.append(f"{when}{machine:<7} {cause}{goes}")
    yield from lines[-most:]


def exploration_table(*headings: str) -> Table:
    """Return a table of explorations."""
    return new_table(*headings, "states", "transitions", "depth", "took")


def figures(report: fsmkit.Report) -> tuple[str, ...]:
    """Return the size of a space as cells of a table."""
    found = report.exploration
    return (
        f"{found.states:,}",
        f"{found.transitions:,}",
        str(found.depth),
        f"{found.seconds:.1f} s",
    )


def verdicts(report: fsmkit.Report, *names: str) -> Iterator[str]:
    """Yield the verdicts of properties, by name."""
    by_name = {result.name: result.verdict for result in report.results}
    for name in names:
        verdict = by_name.get(name)
        word = verdict.value if verdict is not None else "?"
        yield f"[green]{word}[/]" if word == "holds" else f"[bold red]{word}[/]"


def is_holding(report: fsmkit.Report, name: str) -> bool:
    """Whether a property holds."""
    return any(r.name == name and r.verdict is fsmkit.Verdict.HOLDS for r in report.results)


# --- draw ----------------------------------------------------------------------------------------


def draw(summary: Summary) -> None:
    """Write each chart as text for Graphviz and Mermaid, and as a picture where `dot` is there."""
    folder = OUT / "diagrams"
    files: dict[str, str] = {}
    for name in ("module.scxml", *(f"{name}.yaml" for name in CHARTS)):
        chart = fsmkit.read_chart(CELL / name)
        stem = Path(name).stem
        files[f"{stem}.mmd"] = plugin(Drawing, "mermaid").draw(chart, frozenset())
        files[f"{stem}.dot"] = plugin(Drawing, "dot").draw(chart, frozenset())
    write(folder, files)
    console.print(f"{', '.join(sorted(files))} in {shown(folder)}; what is inherited is grey")
    summary.add("diagrams as text, Mermaid and DOT", True, shown(folder))
    if shutil.which("dot") is None:
        summary.miss("diagrams as SVG", "Graphviz's `dot` is not installed (make tools)")
        return
    for name in ("module.scxml", *(f"{name}.yaml" for name in CHARTS)):
        drawn = fsmkit.draw(CELL / name, "svg")
        assert isinstance(drawn, bytes)  # noqa: S101  (a picture)
        (folder / name).with_suffix(".svg").write_bytes(drawn)
    summary.add("diagrams as SVG", True, shown(folder))


# --- all -----------------------------------------------------------------------------------------


def write(folder: Path, files: Mapping[str, str]) -> None:
    """Write texts into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def new_table(*headings: str) -> Table:
    """Return an empty table."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show on a terminal what is being done."""
    with console.status(what):
        yield


def shown(path: Path) -> str:
    """Return a path as short as can be."""
    return os.path.relpath(path)


if __name__ == "__main__":
    sys.exit(main())
