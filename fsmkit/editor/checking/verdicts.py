"""Verdicts as findings, as words over a property, and counterexamples as documents."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from lsprotocol import types

from fsmkit.diagnostics import Span
from fsmkit.editor.checking.background import CheckResult
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.features.lenses import PropertyVerdict
from fsmkit.editor.index.files import normal

SOURCE = "fsmkit check"
MOST_RELATED = 20
"""Maximum number of steps shown with a finding; the document has all."""
Json = Mapping[str, Any]


def words(checked: CheckResult) -> dict[str, PropertyVerdict]:
    """Return the verdict on each property in a few words."""
    return {
        one["name"]: PropertyVerdict(checked.words(one), bool(one.get("steps")))
        for one in checked.report.get("properties", ())
    }


def verdict_diagnostics(
    context: Context, checked: CheckResult
) -> dict[Path, list[types.Diagnostic]]:
    """Return a finding for each property that is violated, where it is written or ends."""
    found: dict[Path, list[types.Diagnostic]] = {}
    for one in checked.report.get("properties", ()):
        if one["verdict"] != "violated":
            continue
        steps = one.get("steps") or []
        at = one.get("at") or _last(steps)
        path, place = _range(context, at, checked.path)
        related = [
            types.DiagnosticRelatedInformation(location, f"step {number}: {_line(step)}")
            for number, step in enumerate(steps, 1)
            for location in _locations(context, step)[:1]
        ]
        message = f"{one['name']} is violated"
        message += f": {one['text']}" if one["text"] and one["text"] != one["name"] else ""
        message += f"\n{one['reason']}" if one["reason"] else ""
        found.setdefault(path, []).append(
            types.Diagnostic(
                place,
                message,
                severity=types.DiagnosticSeverity.Error,
                source=SOURCE,
                code=one["name"],
                related_information=related[-MOST_RELATED:] or None,
                data={"file": uri_of(checked.path), "property": one["name"]},
            )
        )
    return found


def _last(steps: list[Json]) -> Json | None:
    """Return the place of the last step that has one."""
    places = (step["places"][-1] for step in reversed(steps) if step["places"])
    return next(places, None)


def _range(context: Context, at: Json | None, otherwise: Path) -> tuple[Path, types.Range]:
    if at is None:
        return otherwise, types.Range(types.Position(0, 0), types.Position(0, 0))
    path = Path(normal(Path(at["file"])))
    source = context.source(path)
    if source is None:
        here = types.Position(at["line"] - 1, max(0, at["column"] - 1))
        return path, types.Range(here, here)
    start = source.offset(at["line"], at["column"])
    end = source.offset(at["end_line"], at["end_column"])
    return path, context.range(Span(source, start, max(start, end)))


def _locations(context: Context, step: Json) -> list[types.Location]:
    found = []
    for at in step["places"]:
        path, place = _range(context, at, Path())
        found.append(types.Location(uri_of(path), place))
    return found


def _line(step: Json) -> str:
    time = "" if step["at"] is None else f"{step['at'] / 1000:g} ms "
    if not step["machine"]:
        return f"{time}time passes"
    change = f": {', '.join(step['from'])} → {', '.join(step['to'])}"
    return f"{time}{step['machine']} {step['event']}".rstrip() + (
        change if step["from"] != step["to"] else ""
    )


def counterexample(context: Context, checked: CheckResult, name: str) -> Json | None:
    """Return the counterexample of a property as a document, and the location of its last step.

    Returns:
        ``title``, ``markdown`` (the sequence diagram, and steps linked to their lines), ``steps``
        (each with its locations), and ``location`` (the line of the last step).

    """
    one = checked.property(name)
    steps = [] if one is None else one.get("steps") or []
    if one is None or not steps:
        return None
    title = f"{name}: {one['verdict']}"
    lines = [f"# {title}", "", one["text"], "", "```mermaid", one["diagram"].rstrip(), "```", ""]
    lines += [
        line for number, step in enumerate(steps, 1) for line in _shown(context, number, step)
    ]
    if one.get("loop") is not None:
        lines.append(f"\nFrom step {one['loop'] + 1} on this repeats for ever.")
    path, place = _range(context, _last(steps), checked.path)
    return {
        "title": title,
        "markdown": "\n".join(lines),
        "location": {"uri": uri_of(path), "range": _plain(place)},
        "steps": [
            {
                "text": _line(step),
                "to": step["to"],
                "locations": [
                    {"uri": location.uri, "range": _plain(location.range)}
                    for location in _locations(context, step)
                ],
            }
            for step in steps
        ],
    }


def replay(context: Context, checked: CheckResult, name: str) -> Json | None:
    """Return the counterexample of a property as pictures, one for each step.

    Returns:
        ``title`` and ``steps``. Each step has its ``text``, the ``uri`` of the chart that moves,
        the ``active`` states afterwards, and the ``locations`` that it names.

    """
    shown = counterexample(context, checked, name)
    one = checked.property(name)
    if shown is None or one is None:
        return None
    model = context.analyses.analysis(checked.path).model
    charts = {m.name: m.chart.sources[0].name for m in getattr(model, "machines", ())}
    steps = []
    for step, written in zip(one["steps"], shown["steps"], strict=True):
        chart = charts.get(step["machine"])
        path = checked.path if chart is None else Path(normal(Path(chart)))
        steps.append({**written, "uri": uri_of(path), "active": step["to"]})
    return {"title": shown["title"], "steps": steps}


def _shown(context: Context, number: int, step: Json) -> Iterator[str]:
    locations = _locations(context, step)
    text = _line(step).replace("[", "\\[").replace("]", "\\]")
    if locations:
        at = locations[-1]
        yield f"{number}. [{text}]({at.uri}#L{at.range.start.line + 1})"
    else:
        yield f"{number}. {text}"
    for more in (*step["chosen"], *step["sent"]):
        yield f"   - {more}"


def _plain(place: types.Range) -> Json:
    return {
        "start": {"line": place.start.line, "character": place.start.character},
        "end": {"line": place.end.line, "character": place.end.character},
    }
