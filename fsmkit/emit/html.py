"""HTML: text is escaped unless a function of this module built it, so names are never markup."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from fsmkit.emit.written import plain
from fsmkit.emit.xml import characters

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""The content security policy of a page: no scripts, and nothing external."""
VOID = frozenset({"img", "hr", "br"})
"""Elements without an end tag."""


class Markup(str):
    """HTML that a function of this module built."""

    __slots__ = ()


def element(tag: str, *content: str, **attributes: str) -> Markup:
    """Return an element; its content is escaped unless it is `Markup`.

    A trailing underscore of the name of an attribute is dropped: ``class_``.
    """
    given = "".join(
        f' {name.rstrip("_")}="{_escaped(value)}"' for name, value in attributes.items()
    )
    if tag in VOID:
        return Markup(f"<{tag}{given}>")
    return Markup(f"<{tag}{given}>{join(content)}</{tag}>")


def join(parts: Iterable[str], between: str = "") -> Markup:
    """Return the parts as one piece of HTML; those that are not `Markup` are escaped."""
    pieces = (str(p) if isinstance(p, Markup) else _escaped(p) for p in parts)
    return Markup(_escaped(between).join(pieces))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[str]], class_: str = "", caption: str = ""
) -> Markup:
    """Return a table; cells are escaped unless they are `Markup`."""
    head = element("tr", *(element("th", one, scope="col") for one in heads))
    body = (element("tr", *(element("td", cell) for cell in row)) for row in rows)
    title = [element("caption", caption)] if caption else []
    return element(
        "div",
        element("table", *title, element("thead", head), element("tbody", *body)),
        class_=f"table {class_}".strip(),
    )


def listing(items: Iterable[str], class_: str = "") -> Markup:
    """Return a list of bullets."""
    return element("ul", *(element("li", item) for item in items), class_=class_ or "plain")


def page(title: str, *body: str, style: str = "") -> Markup:
    """Return a whole page that loads nothing and runs no script."""
    head = (
        Markup("<meta charset='utf-8'>"),
        Markup(f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'),
        Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", title),
        Markup(f"<style>{STYLE}{style}</style>"),
    )
    whole = element("html", element("head", *head), element("body", *body), lang="en")
    return Markup(f"<!doctype html>\n{whole}\n")


def _escaped(text: str) -> str:
    return escape(characters(plain(text)), quote=True)


STYLE = """
:root {
  color-scheme: light dark;
  --ink: light-dark(#1d232b, #dfe5ec); --soft: light-dark(#5a6572, #98a4b3);
  --page: light-dark(#ffffff, #14181d); --panel: light-dark(#f5f7f9, #1c2229);
  --line: light-dark(#d9dfe6, #313a45); --accent: light-dark(#0b5cad, #74b3f2);
  --good: light-dark(#1b7a36, #6ccb86); --bad: light-dark(#b3261e, #ff8a80);
  --open: light-dark(#8a5a00, #e8b356);
}
* { box-sizing: border-box; }
body { font: 15px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--page);
  margin: 0 auto; padding: 2.5rem 1.5rem 5rem; max-width: 76rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.3rem; margin: 2.8rem 0 .8rem; padding-top: .8rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.02rem; margin: 1.6rem 0 .5rem; }
p { max-width: 48rem; margin: .5rem 0; }
a { color: var(--accent); }
code, .mono { font: .88em/1.4 ui-monospace, monospace; overflow-wrap: anywhere; }
.soft { color: var(--soft); }
.table { overflow-x: auto; margin: .8rem 0; border: 1px solid var(--line); border-radius: 6px; }
table { border-collapse: collapse; width: 100%; font-size: .93em; }
th, td { padding: .42rem .75rem; text-align: left; vertical-align: top; }
th { background: var(--panel); font-weight: 600; white-space: nowrap; }
tbody tr { border-top: 1px solid var(--line); }
.figures td:not(:first-child), .figures th:not(:first-child) { text-align: right;
  font-variant-numeric: tabular-nums; }
caption { text-align: left; padding: .5rem .75rem; color: var(--soft); }
ul.plain { margin: 0; padding: 0; list-style: none; }
ul.plain li + li { margin-top: .2rem; }
.mark { font-weight: 600; white-space: nowrap; }
.mark::before { content: ""; display: inline-block; width: .6em; height: .6em; border-radius: 50%;
  background: currentColor; margin-right: .45em; }
.good { color: var(--good); } .bad { color: var(--bad); } .open { color: var(--open); }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .8rem;
  margin: 1.4rem 0; }
.card { background: var(--panel); border: 1px solid var(--line); border-radius: 8px;
  padding: .8rem 1rem; }
.card b { display: block; font-size: 1.45rem; line-height: 1.3; }
.card span { color: var(--soft); font-size: .9em; }
.note { background: var(--panel); border-left: 3px solid var(--accent); padding: .6rem 1rem;
  border-radius: 0 6px 6px 0; }
img { max-width: 100%; background: #fff; border-radius: 6px; border: 1px solid var(--line); }
details { margin: .6rem 0; } summary { cursor: pointer; }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; }
  h2 { break-after: avoid; } tr { break-inside: avoid; } .table { overflow: visible; } }
"""
