"""Three-way merge of the texts of a chart: comments and layout stay, conflicts are marked.

The lines are merged by git. If they merge to the merged meaning, that text is the result.
Otherwise the text whose lines come closest is changed to the merged meaning.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.compare import differences
from fsmkit.chart.differences.facts import DECLARATIONS
from fsmkit.chart.merging.documents import Merge, merged
from fsmkit.chart.merging.versions import Conflict, Versions
from fsmkit.diagnostics import Diagnostic, Findings, FsmkitError, Source, Span
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.editor.editing.applying import edited, read
from fsmkit.editor.editing.operations import RenameSymbol
from fsmkit.editor.editing.renaming import rename_edits
from fsmkit.editor.editing.xml_edits import located_xml_remarks, with_xml_remarks, xml_remarks
from fsmkit.editor.editing.yaml_edits import located_remarks, with_remarks
from fsmkit.editor.formatting.concrete import remarks

MARKER_SIZE = 7
"""Characters of a conflict marker."""
RENAMED = {"state", *DECLARATIONS.values()} - {"property"}
"""The words of `differences` that are kinds of symbols."""
FAILED = 128
"""Exit codes of `git merge-file` from here on are errors, not numbers of conflicts."""


@dataclass(frozen=True, slots=True)
class Checked:
    """A checked text: its findings, and its chart if it is one without errors."""

    findings: tuple[Diagnostic, ...]
    chart: Chart | None = None

    @property
    def errors(self) -> set[tuple[str, str]]:
        """The rules and messages of the errors."""
        return {
            (one.rule.name, one.message) for one in self.findings if one.severity.value == "error"
        }


Check = Callable[[str], Checked]


@dataclass(frozen=True, slots=True)
class MergedText:
    """The result: a text, with conflict markers if there are conflicts.

    ``is_by_meaning`` is false if only the lines were merged. ``warnings`` are findings that
    neither version has.
    """

    text: str
    conflicts: tuple[Diagnostic, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    is_by_meaning: bool = True


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines as git merges them, and with ours where they meet."""

    text: str
    is_conflict: bool
    preferring_ours: str


def merge_texts(
    base: Source, ours: Source, theirs: Source, check: Check, *, marker_size: int = MARKER_SIZE
) -> MergedText:
    """Return the merge of two versions of a file.

    Args:
        base: The common ancestor.
        ours: The version whose layout and comments stay.
        theirs: The other version.
        check: Returns the findings of a text of this file.
        marker_size: Characters of a conflict marker.

    """
    if theirs.text in (base.text, ours.text) or ours.text == base.text:
        text = theirs.text if ours.text == base.text else ours.text
        return MergedText(text)
    here, there = check(ours.text), check(theirs.text)
    known = here.errors | there.errors
    merge = None
    findings: list[Diagnostic] = []
    try:
        versions = [base, ours, theirs]
        if here.chart is not None and there.chart is not None:
            versions = _renamed(versions, check(base.text).chart, here.chart, there.chart)
        base, ours, theirs = versions
        merge = merged(read(base), read(ours), read(theirs))
    except FsmkitError as error:  # not charts, or unreadable ones
        findings += [one for one in error.diagnostics if one.rule.name == "merge-conflict"]
    lines = merged_lines(base.text, ours.text, theirs.text, marker_size)
    if merge is None:
        conflicts = _by_lines(lines, findings, known, check)
        text = _marked(lines, conflicts, marker_size, is_markup=is_xml(ours))
        return MergedText(text, tuple(conflicts), is_by_meaning=False)
    conflicts = [_finding(one) for one in merge.conflicts]
    if not conflicts:
        written = _written(base, ours, theirs, merge, lines)
        if written is None:
            conflicts.append(
                _finding(Conflict("the text cannot express the changes of both versions"))
            )
        else:
            result = check(written)
            conflicts = _new_errors(result, known)
            if not conflicts:
                before = {(one.rule.name, one.message) for one in (*here.findings, *there.findings)}
                new = [f for f in result.findings if (f.rule.name, f.message) not in before]
                return MergedText(written, (), tuple(new))
    text = _marked(lines, conflicts, marker_size, is_markup=is_xml(ours))
    return MergedText(text, tuple(conflicts))


def merged_lines(base: str, ours: str, theirs: str, marker_size: int = MARKER_SIZE) -> Lines:
    """Return the merge of the lines of three texts by `git merge-file`.

    Raises:
        FsmkitError: ``merge-conflict`` if git is not installed or fails.

    """
    with tempfile.TemporaryDirectory() as created:
        paths = [Path(created, name) for name in ("ours", "base", "theirs")]
        for path, text in zip(paths, (ours, base, theirs), strict=True):
            path.write_bytes(text.encode("utf-8", "surrogateescape"))
        command = ["git", "merge-file", "-p", f"--marker-size={marker_size}"]
        for path in paths:
            command += ["-L", path.name]
        found = []
        for option in ([], ["--ours"]):
            try:
                done = subprocess.run(
                    [*command, *option, *map(str, paths)], capture_output=True, check=False
                )
            except FileNotFoundError as error:
                raise _failed("git is not installed") from error
            if done.returncode >= FAILED:
                raise _failed(done.stderr.decode(errors="replace").strip())
            found.append((done.stdout.decode("utf-8", "surrogateescape"), done.returncode > 0))
    (text, is_conflict), (preferring_ours, _) = found
    return Lines(text, is_conflict, preferring_ours)


def _failed(why: str) -> FsmkitError:
    findings = Findings()
    findings.add(
        "merge-conflict", f"the lines cannot be merged: {why}", None, help="merge them by hand"
    )
    return FsmkitError(findings)


# --- renames --------------------------------------------------------------------------------------


def _renamed(
    versions: list[Source], base: Chart | None, ours: Chart, theirs: Chart
) -> list[Source]:
    """Return the three texts with the names that either version gave.

    Raises:
        FsmkitError: ``merge-conflict`` if a new name cannot be used in the other version.

    """
    if base is None:
        return versions
    found = [[*_renames(base, new)] for new in (ours, theirs)]
    for operation in dict.fromkeys((*found[0], *found[1])):
        for number, source in enumerate(versions):
            if number and operation in found[number - 1]:
                continue
            try:
                edits = rename_edits(source, operation)
            except FsmkitError as error:
                if number == 0:
                    continue
                conflict = Conflict(
                    f"{operation.kind} `{operation.name}` was renamed to `{operation.new}`, "
                    f"which does not fit the other version: {error.diagnostics[0].message}"
                )
                raise FsmkitError([_finding(conflict)]) from error
            versions = [*versions]
            versions[number] = Source(source.name, apply_edits(source.text, edits))
    return versions


def _renames(old: Chart, new: Chart) -> Iterator[RenameSymbol]:
    for change in differences(old, new):
        name = change.details[0] if change.details else None
        if change.kind != "renamed" or change.what not in RENAMED or name is None:
            continue
        if not name.old.startswith(("done.", "error.")):  # these follow the states
            yield RenameSymbol(change.what, f"{name.old}", f"{name.new}")


# --- texts ----------------------------------------------------------------------------------------


def _written(base: Source, ours: Source, theirs: Source, merge: Merge, lines: Lines) -> str | None:
    """Return a text with the merged meaning that keeps the most comments; None if none can."""
    find = xml_remarks if is_xml(ours) else remarks
    wanted = wanted_remarks(*(Counter(find(one)) for one in (base, ours, theirs)))
    best: tuple[int, int, str] | None = None
    starts = [lines.preferring_ours if lines.is_conflict else lines.text, ours.text]
    for start in dict.fromkeys(starts):
        source = Source(ours.name, start)
        for text in _changed(source, base, theirs, merge):
            found = Counter(find(Source(ours.name, text)))
            rank = (wanted - found).total(), (found - wanted).total(), text
            if best is None or rank[:2] < best[:2]:
                best = rank
            if rank[:2] == (0, 0):
                return text
    if best is None:
        return None
    text = best[-1]
    missing = wanted - Counter(find(Source(ours.name, text)))
    return _with_missing(Source(ours.name, text), ours, theirs, missing) if missing else text


def wanted_remarks(base: Counter[str], ours: Counter[str], theirs: Counter[str]) -> Counter[str]:
    """Return the comments of the result: each as often as the version that changed it has it."""
    wanted: Counter[str] = Counter()
    for remark in ours | theirs:
        counts = Versions(base[remark], ours[remark], theirs[remark])
        most = max(counts.ours, counts.theirs)
        wanted[remark] = most if counts.is_conflict else counts.merged
    return wanted


def _changed(source: Source, base: Source, theirs: Source, merge: Merge) -> Iterator[str]:
    """Yield the texts that a start can be changed to: with all its comments, and with fewer."""
    try:
        old = read(source)
    except FsmkitError:
        return
    if old == merge.document:
        yield source.text
        return
    again = merged(read(base), old, read(theirs))
    if again is None or again.conflicts or again.document != merge.document:
        return
    for keeps_comments in (True, False) if again.removes else (True,):
        try:
            yield edited(source, old, again.document, keeps_comments=keeps_comments)
        except FsmkitError:
            continue


def _with_missing(source: Source, ours: Source, theirs: Source, missing: Counter[str]) -> str:
    """Return a text with missing comments put at the states that they belong to."""
    locate, write = (
        (located_xml_remarks, with_xml_remarks)
        if is_xml(source)
        else (located_remarks, with_remarks)
    )
    given: dict[str, list[str]] = {}
    for version in (ours, theirs):
        for state, remark in locate(version, read(version)):
            if missing[remark]:
                missing[remark] -= 1
                given.setdefault(state, []).append(remark)
    return write(source, read(source), given)


# --- conflicts ------------------------------------------------------------------------------------


def _by_lines(
    lines: Lines, findings: list[Diagnostic], known: set[tuple[str, str]], check: Check
) -> list[Diagnostic]:
    """Return the conflicts of a file that is merged as lines."""
    if lines.is_conflict:
        return [*findings, _finding(Conflict("both versions changed the same lines"))]
    return findings or _new_errors(check(lines.text), known)


def _new_errors(result: Checked, known: set[tuple[str, str]]) -> list[Diagnostic]:
    """Return the errors of a result that neither version has, as conflicts."""
    found = [one for one in result.findings if one.severity.value == "error"]
    return [
        replace(_finding(Conflict(f"the merged file is wrong: {one.message}")), primary=one.primary)
        for one in found
        if (one.rule.name, one.message) not in known
    ]


def _finding(conflict: Conflict) -> Diagnostic:
    findings = Findings()
    places: list[tuple[Span, str]] = [
        (span, label)
        for span, label in (
            (conflict.ours, "ours"),
            (conflict.theirs, "theirs"),
            (conflict.base, "base"),
        )
        if span is not None
    ]
    first = places[0] if places else (None, "")
    findings.add(
        "merge-conflict",
        conflict.message,
        first[0],
        label=first[1],
        secondary=places[1:],
        help="edit the file, then `git add` it",
    )
    return next(iter(findings))


def _marked(lines: Lines, conflicts: Sequence[Diagnostic], size: int, *, is_markup: bool) -> str:
    """Return the merged lines with conflict markers; with the reasons where git marks nothing."""
    if lines.is_conflict or not conflicts:
        return lines.text
    start, middle, end = (sign * size for sign in "<=>")
    shown = [
        "\n".join(
            _comment(f"{one.message}{_lines_of(one, side)}", is_markup=is_markup)
            for one in conflicts
        )
        for side in ("ours", "theirs")
    ]
    block = f"{start} ours\n{shown[0]}\n{middle}\n{shown[1]}\n{end} theirs\n"
    return f"{block}{lines.text}"


def _lines_of(conflict: Diagnostic, side: str) -> str:
    labels = (conflict.primary, *conflict.secondary)
    found = [one.span for one in labels if one is not None and one.text == side]
    if not found:
        return ""
    return f" (line {found[0].source.position(found[0].start)[0]} of {side})"


def _comment(text: str, is_markup: bool) -> str:
    text = " ".join(text.split())
    return f"<!-- {text.replace('--', '- -')} -->" if is_markup else f"# {text}"
