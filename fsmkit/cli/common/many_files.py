"""``fsmkit check`` of several files and of folders: a line each, the worst exit code."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.text import Text

from fsmkit.chart.loading import read_bytes, read_document
from fsmkit.cli.common.console import crash, print_json, report, result
from fsmkit.cli.common.exhausted import exhausted
from fsmkit.cli.common.interrupts import received
from fsmkit.codegen.existing_c.reader import SUFFIXES as BINDINGS
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.diagnostics.as_json import as_json
from fsmkit.document.project import Project, project_of
from fsmkit.system.system import System
from fsmkit.verify.report.figures import count_text
from fsmkit.verify.report.show import STYLES
from fsmkit.verify.report.verdict import Report, Verdict

TESTS = (".test.yaml", ".test.yml")
"""Suffixes of test files."""

Evaluate = Callable[[Path], tuple[System, Report]]
Document = Callable[[Report], Mapping[str, object]]

MODELS = {
    ".scxml": re.compile(rb"<(\w+:)?scxml\b"),
    ".xml": re.compile(rb"<(\w+:)?scxml\b"),
    ".yaml": re.compile(rb"^(\xef\xbb\xbf)?(chart|system)\s*:", re.MULTILINE),
    ".yml": re.compile(rb"^(\xef\xbb\xbf)?(chart|system)\s*:", re.MULTILINE),
}
"""Suffixes of charts and systems, and the content that identifies them."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of one file: a report, or an exit code and the reason."""

    file: Path
    report: Report | None
    code: int
    error: FsmkitError | None = None

    @property
    def word(self) -> str:
        """Return the verdict as a word; ``error`` without a report."""
        return "error" if self.report is None else self.report.verdict.value


def check_several(paths: Sequence[Path], evaluate: Evaluate, document: Document | None) -> int:
    """Check all charts and systems in `paths`; return the highest exit code.

    An internal error in one file is reported, and the others continue; an interrupt stops all.
    ``document`` converts a report to data; then one JSON document with all of them is printed.
    """
    named = tuple(dict.fromkeys(file for path in paths for file in models(path)))
    files = tuple(file for file in named if not is_abstract(file))
    if not files:
        raise _nothing("chart that is not abstract", paths)
    answers: list[Answer] = []
    for file in files:
        answers.append(_answer(file, evaluate, is_shown=document is None))
        if received():
            break
    code = max(answer.code for answer in answers)
    if document is not None:
        print_json({"code": code, "files": [_document(answer, document) for answer in answers]})
    else:
        counts = {word: sum(a.word == word for a in answers) for word in ORDER}
        summary = ", ".join(f"{n} {SHOWN[word]}" for word, n in counts.items() if n)
        skipped = len(named) - len(files)
        summary += f"; {skipped} abstract skipped" if skipped else ""
        missing = len(files) - len(answers)
        summary += f"; interrupted, {missing} not checked" if missing else ""
        result.print(f"{len(answers)} files: {summary}", style="dim")
    return code


def models(path: Path) -> Iterator[Path]:
    """Yield a file, or all charts and systems below a folder.

    Hidden files and folders are passed over. Raises `FsmkitError` where a folder has none.
    """
    if not path.is_dir():
        yield path
        return
    project = project_of(path)
    found = [file for file in files_below(path, project) if is_model(file)]
    if not found:
        raise _nothing("chart or system", (path,))
    yield from found


def _nothing(what: str, paths: Sequence[Path]) -> FsmkitError:
    return fail(
        "nothing-to-check",
        f"there is no {what} in {', '.join(f'`{path}`' for path in paths)}",
        help="a chart is SCXML, or YAML with the key `chart`; a system has the key `system`",
    )


def files_below(folder: Path, project: Project | None = None) -> Iterator[Path]:
    """Yield the files below a folder by name, files before folders, without excluded ones."""
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    if project is not None and project.exclude:
        entries = [entry for entry in entries if not project.excludes(entry)]
    yield from (entry for entry in entries if entry.is_file())
    for entry in entries:
        if entry.is_dir() and not entry.is_symlink():
            yield from files_below(entry, project)


def is_model(file: Path) -> bool:
    """Whether a file is a chart or a system, by its first look."""
    marks = MODELS.get(file.suffix.lower())
    if marks is None or file.name.lower().endswith((*BINDINGS, *TESTS)):  # `chart` names a file
        return False
    return marks.search(read_bytes(file)) is not None


def is_abstract(file: Path) -> bool:
    """Return whether a file is an abstract chart; False if it has an error."""
    try:
        return read_document(file, Findings()).abstract
    except FsmkitError:
        return False


def _answer(file: Path, evaluate: Evaluate, *, is_shown: bool) -> Answer:
    """Check one file; print its findings and its line."""
    try:
        _, found = evaluate(file)
        report(found.findings)
        answer = Answer(file, found, int(found.verdict is not Verdict.HOLDS))
    except FsmkitError as error:
        report(error.diagnostics)
        answer = Answer(file, None, 1, error)
    except Exception as error:  # noqa: BLE001  (as in `fsmkit.cli`: a bug becomes a report)
        told = exhausted(error)
        if told is not None:
            report(told.diagnostics)
        answer = Answer(file, None, crash(error) if told is None else 1, told)
    if is_shown:
        result.print(_line(answer))
    return answer


def _line(answer: Answer) -> Text:
    found = answer.report
    if found is None:
        return Text.assemble((f"{'ERROR':10}", "bold red"), str(answer.file))
    line = Text.assemble((f"{answer.word.upper():10}", STYLES[found.verdict]), str(answer.file))
    wrong = [one.name for one in found.results if one.verdict is not Verdict.HOLDS]
    explored = found.exploration
    line.append(f"  {count_text(explored.states)} states, {explored.seconds:.1f} s", "dim")
    return line.append(f"  {', '.join(wrong)}" if wrong else "")


def _document(answer: Answer, document: Document) -> dict[str, object]:
    if answer.report is not None:
        return {"file": str(answer.file), **document(answer.report)}
    told = () if answer.error is None else answer.error.diagnostics
    return {
        "file": str(answer.file),
        "verdict": "error",
        "findings": [as_json(diagnostic) for diagnostic in told],
    }


ORDER = (*(verdict.value for verdict in Verdict), "error")
SHOWN = {"holds": "hold", "error": "with errors"}
SHOWN |= {word: word for word in ORDER if word not in SHOWN}
