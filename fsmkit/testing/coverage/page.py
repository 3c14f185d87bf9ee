"""Coverage as one page of HTML: figures, drawings in colours, sources with counts in the margin."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape

from fsmkit.emit.xml import characters
from fsmkit.testing.coverage.record import ChartCoverage
from fsmkit.testing.coverage.reports import Figure, Line, figures, lines, missing, total

STYLE = """
:root { color-scheme: light dark; --hit: #2e7d32; --part: #b26a00; --miss: #c62828; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem; }
table { border-collapse: collapse; } th, td { padding: .15rem .8rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 1px solid; } tfoot td { border-top: 1px solid; }
pre { overflow-x: auto; font: 13px/1.45 ui-monospace, monospace; }
.n, .c { display: inline-block; text-align: right; user-select: none; }
.n { width: 3.5em; opacity: .6; } .c { width: 6.5em; margin: 0 1em 0 .5em; }
.hit .c { color: var(--hit); } .part .c { color: var(--part); } .miss .c { color: var(--miss); }
.miss { background: color-mix(in srgb, var(--miss) 14%, transparent); display: block; }
.part { background: color-mix(in srgb, var(--part) 14%, transparent); display: block; }
.hit, .none { display: block; }
img { max-width: 100%; background: #fff; } summary { cursor: pointer; }
"""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
MISS = "#c62828"
HIT = "#2e7d32"
Drawing = Callable[[ChartCoverage], str]
"""The SVG of a chart, or an empty string."""


def page(
    charts: Sequence[ChartCoverage], sources: Mapping[str, str], drawing: Drawing | None = None
) -> str:
    """Return the page.

    Args:
        charts: The coverage.
        sources: The sources by file name; a missing one is omitted.
        drawing: Draws a chart with the ids `s12` and `t25`.

    """
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        f"<title>Coverage</title><style>{STYLE}</style></head><body><h1>Coverage</h1>",
        *_table(charts),
    ]
    for chart in charts:
        parts += _chart(chart, drawing)
    for file, numbered in lines(charts).items():
        if file in sources:
            parts += _source(file, sources[file], numbered)
    return "\n".join((*parts, "</body></html>", ""))


def _text(text: str) -> str:
    return escape(characters(text), quote=True)


def _table(charts: Sequence[ChartCoverage]) -> Iterator[str]:
    yield "<table><thead><tr><th>chart</th><th>states</th><th>transitions</th>"
    yield "<th>decisions</th><th>conditions (MC/DC)</th><th>all</th></tr></thead><tbody>"
    for chart in charts:
        own = figures(chart)
        cells = own.states, own.transitions, own.decisions, own.conditions, own.whole
        yield f"<tr><td>{_text(chart.name)}</td>{''.join(map(_cell, cells))}</tr>"
    whole = total(charts)
    cells = whole.states, whole.transitions, whole.decisions, whole.conditions, whole.whole
    yield f"</tbody><tfoot><tr><td>all</td>{''.join(map(_cell, cells))}</tr></tfoot></table>"


def _cell(figure: Figure) -> str:
    return f"<td>{figure.covered} of {figure.all}</td>"


def _chart(chart: ChartCoverage, drawing: Drawing | None) -> Iterator[str]:
    yield f"<h2>{_text(chart.name)}</h2>"
    left = list(missing(chart))
    if left:
        yield f"<details open><summary>{len(left)} not covered</summary><ul>"
        yield from (f"<li><code>{_text(at)}</code> {_text(what)}</li>" for at, what in left)
        yield "</ul></details>"
    drawn = "" if drawing is None else drawing(chart)
    if drawn:
        coloured = b64encode(_colour_drawing(drawn, chart).encode()).decode()
        yield f'<img alt="Drawing of {_text(chart.name)}: green is covered, red is not"'
        yield f' src="data:image/svg+xml;base64,{coloured}">'


def _colour_drawing(drawn: str, chart: ChartCoverage) -> str:
    """Return a drawing with uncovered items red and dashed, the others green."""
    rules = []
    for prefix, items in (("s", chart.states), ("t", chart.transitions)):
        for item in items:
            colour, dash = (HIT, "none") if item.count else (MISS, "4 3")
            name = f"#{prefix}{item.number}"
            shapes = f"{name} path, {name} polygon"
            rules.append(f"{shapes} {{ stroke: {colour}; stroke-dasharray: {dash}; }}")
    start, end, rest = drawn.rpartition("</svg>")
    return f"{start}<style>{' '.join(rules)}</style>{end}{rest}" if end else drawn


def _source(file: str, text: str, numbered: Mapping[int, Line]) -> Iterator[str]:
    yield f"<h2>{_text(file)}</h2>"
    written = enumerate(text.splitlines(), 1)
    yield f"<pre>{''.join(_line(n, line, numbered.get(n)) for n, line in written)}</pre>"


def _line(number: int, written: str, line: Line | None) -> str:
    kind, count = "none", ""
    if line is not None:
        taken = sum(map(bool, line.branches))
        kind = "miss" if not line.hits else "part" if taken < len(line.branches) else "hit"
        branches = f" ({taken}/{len(line.branches)})" if line.branches else ""
        count = f"{line.hits:,}{branches}"
    return (
        f'<span class="{kind}"><span class="n">{number}</span><span class="c">{count}</span>'
        f"{_text(written)}</span>"
    )
