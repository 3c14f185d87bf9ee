"""A certificate as a page of HTML that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from fsmkit.emit import telling
from fsmkit.verify.certify.show import RESULTS, covered

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; }
td, th { border-bottom: 1px solid #ccc; padding: .25rem .8rem .25rem 0; text-align: left;
  vertical-align: top; }
td.number, th.number { text-align: right; }
code { font-size: 13px; overflow-wrap: anywhere; }
.complete { color: #1a6b2f; } .partial { color: #8a5a00; } .different { color: #a11; }
"""


@telling
def page(document: Mapping[str, Any]) -> str:
    """Return the page of a certificate."""
    title = f"{document['chart']} on {document['target']}"
    coverage = [
        (name, f"{found['covered']} of {found['all']}")
        for name, found in document["coverage"].items()
    ]
    result = document["result"]
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{_text(title)}</title>',
        f"<style>{STYLE}</style></head><body>",
        f"<h1>{_text(title)}</h1>",
        f'<p class="{_text(result)}"><strong>{_text(result)}</strong>: {_text(RESULTS[result])}.',
        f"{_text(covered(document))}.</p>",
        *_section("Why it is partial", _list(document["reasons"])),
        *_section("Differences", _differences(document["differences"])),
        *_section("Compared", _table(_facts(document) + coverage)),
        *_section("Worst cases", _maxima(document["maxima"])),
        *_section("Assumptions", _list(document["assumptions"])),
        *_section("Files", _table(_files(document), is_code=True)),
        (
            f"<p>SHA-256 of the certificate: <code>{_text(document['sha256'])}</code>."
            " <code>fsmkit certify --verify certificate.json</code> checks it.</p>"
        ),
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _text(value: object) -> str:
    return escape(str(value))


def _section(title: str, content: Sequence[str]) -> list[str]:
    return [f"<h2>{title}</h2>", *content] if content else []


def _facts(document: Mapping[str, Any]) -> list[tuple[str, str]]:
    seconds = ", ".join(f"{name} {value} s" for name, value in document["seconds"].items())
    return [
        ("steps", f"{document['steps']:,}"),
        ("states", f"{document['states']:,}"),
        ("states left", f"{document['states_left']:,}"),
        ("classes of values", f"{document['classes']:,}"),
        ("steps of the interpreter", f"{document['interpreted']:,}"),
        *(
            [("steps of the emulator", f"{document['emulated']:,}")]
            if document["emulated"] is not None
            else []
        ),
        (
            "repeated with other values, or with hosts that act during calls",
            f"{document['repeated']:,}",
        ),
        ("compiler", document["compiler"]),
        ("compiler of this computer", document["host"]["compiler"]),
        ("form of the C", document["form"]),
        ("versions", ", ".join(f"{name} {value}" for name, value in document["versions"].items())),
        ("time", seconds),
    ]


def _table(rows: Iterable[tuple[str, str]], *, is_code: bool = False) -> list[str]:
    tag = "code" if is_code else "span"
    return [
        "<table>",
        *(
            f"<tr><td>{_text(name)}</td><td><{tag}>{_text(value)}</{tag}></td></tr>"
            for name, value in rows
        ),
        "</table>",
    ]


def _list(items: Sequence[str]) -> list[str]:
    return ["<ul>", *(f"<li>{_text(each)}</li>" for each in items), "</ul>"] if items else []


def _differences(found: Sequence[Mapping[str, Any]]) -> list[str]:
    return _list([f"{_path([*each['path'], each['step']])}: {each['what']}" for each in found])


def _path(steps: Sequence[str]) -> str:
    return " → ".join(steps)


def _maxima(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    if not rows:
        return []
    found = [
        (
            "<table><tr><th>step</th><th class=number>instructions</th><th class=number>cycles</th>"
            "<th class=number>stack bytes</th><th>shortest path to the most instructions</th></tr>"
        )
    ]
    for row in rows:
        cycles = "" if row["cycles"] is None else f"{row['cycles']:,}"
        numbers = (f"{row['instructions']:,}", cycles, f"{row['stack']:,}")
        cells = "".join(f"<td class=number>{_text(each)}</td>" for each in numbers)
        path = _text(_path(row["path"]))
        found.append(f"<tr><td>{_text(row['step'])}</td>{cells}<td>{path}</td></tr>")
    return [*found, "</table>"]


def _files(document: Mapping[str, Any]) -> list[tuple[str, str]]:
    found = [(each["file"], each["sha256"]) for each in document["sources"]]
    found += [*document["generated"].items(), *document["objects"].items()]
    firmware = document["firmware"]
    return found + ([] if firmware is None else [(firmware["file"], firmware["sha256"])])
