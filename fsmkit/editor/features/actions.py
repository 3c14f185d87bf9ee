"""Code actions: the fixes that findings carry, declarations, allowed rules, refactorings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Diagnostic, Fix
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.features.declaring import declaration_fixes, suppression_fixes
from fsmkit.editor.features.diagnostics import diagnostic_of
from fsmkit.editor.features.refactoring import refactorings
from fsmkit.editor.index.files import normal

FIX_ALL = f"{types.CodeActionKind.SourceFixAll.value}.fsmkit"
KINDS = [
    types.CodeActionKind.QuickFix,
    types.CodeActionKind.RefactorExtract,
    types.CodeActionKind.RefactorInline,
    FIX_ALL,
]
"""All kinds that there are."""


def code_actions(
    context: Context,
    path: Path,
    place: types.Range,
    only: Iterable[str] | None,
    roots: Iterable[Path],
    *,
    is_requested: bool = False,
) -> list[types.CodeAction]:
    """Return the code actions for a selection.

    Args:
        context: The editor.
        path: The file.
        place: The selection.
        only: The requested kinds; None for all.
        roots: The open files; their findings may have fixes in this file.
        is_requested: Whether the user requested actions; then refactorings are offered without a
            selection, too.

    """
    found: list[types.CodeAction] = []
    sure: list[Fix] = []
    for root in dict.fromkeys((path, *roots)):
        for finding in context.analyses.analysis(root).findings:
            if _file(finding) != path or finding.primary is None:
                continue
            sure += [fix for fix in finding.fixes[:1] if fix.is_sure]
            at = context.range(finding.primary.span)
            if not _overlap(at, place):
                continue
            shown = diagnostic_of(context, finding)
            allowed = suppression_fixes(finding)
            more = (*declaration_fixes(context, path, finding), *((allowed,) if allowed else ()))
            for number, fix in enumerate((*finding.fixes, *more)):
                found.append(
                    types.CodeAction(
                        fix.title,
                        kind=types.CodeActionKind.QuickFix,
                        diagnostics=[shown],
                        is_preferred=number == 0 and fix.is_sure,
                        edit=types.WorkspaceEdit(changes=changes(context, [fix])),
                    )
                )
    if is_requested or place.start != place.end:
        for one in refactorings(context, path, place):
            edit = types.WorkspaceEdit(changes=changes(context, [one.fix()]))
            reason = types.CodeActionDisabled(one.refused) if one.refused else None
            found.append(
                types.CodeAction(
                    one.title, kind=one.kind, edit=None if reason else edit, disabled=reason
                )
            )
    if sure:
        edit = types.WorkspaceEdit(changes=changes(context, sure))
        found.append(types.CodeAction("Apply all safe fixes", kind=FIX_ALL, edit=edit))
    unique = {(action.title, str(action.edit)): action for action in found}
    return [a for a in unique.values() if only is None or _is_requested(a.kind, only)]


def _is_requested(kind: object, only: Iterable[str]) -> bool:
    kind = str(getattr(kind, "value", kind))
    wanted = [getattr(one, "value", one) for one in only]
    return any(kind == one or kind.startswith(f"{one}.") or one == "" for one in wanted)


def _file(finding: Diagnostic) -> Path | None:
    if finding.primary is None:
        return None
    return Path(normal(Path(finding.primary.span.source.name)))


def _overlap(one: types.Range, other: types.Range) -> bool:
    def order(position: types.Position) -> tuple[int, int]:
        return position.line, position.character

    return order(one.start) <= order(other.end) and order(other.start) <= order(one.end)


def changes(context: Context, fixes: Iterable[Fix]) -> Mapping[str, list[types.TextEdit]]:
    """Return the edits of fixes by file; of those that overlap the first counts."""
    found: dict[str, list[types.TextEdit]] = {}
    taken: dict[str, list[tuple[int, int]]] = {}
    for fix in fixes:
        for edit in fix.edits:
            uri = uri_of(Path(normal(Path(edit.span.source.name))))
            start, end = edit.span.start, edit.span.end
            if any(start < e and s < end for s, e in taken.get(uri, ())):
                continue
            text_edit = types.TextEdit(context.range(edit.span), edit.text)
            if text_edit not in found.get(uri, ()):
                taken.setdefault(uri, []).append((start, end))
                found.setdefault(uri, []).append(text_edit)
    return found
