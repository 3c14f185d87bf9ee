"""Reports of XML syntax errors in terms of the typed text: quotes, brackets, tags, prefixes."""

from __future__ import annotations

import re

from fsmkit.diagnostics import Findings, Source, Span
from fsmkit.scxml.names import EXTENSION, PREFIX

KNOWN = "`&lt;` `&gt;` `&amp;` `&quot;` `&apos;`"
OF_PREFIXES = {PREFIX: EXTENSION, "fsmkit": EXTENSION}
PREFIXED = re.compile(r"[<\s/]([\w.-]+):[\w.-]+")


def report_broken(source: Source, at: int, problem: str, open_: str, findings: Findings) -> None:
    """Report a syntax error of the XML parser.

    Args:
        source: The text.
        at: The offset of the error.
        problem: The message of the parser.
        open_: The innermost open element; empty if none is open.
        findings: Where to report.

    """
    message, advice = _reason(source.text, at, problem, open_)
    findings.add("broken-xml", f"this is not XML: {message}", Span(source, at, at + 1), help=advice)


def _reason(text: str, at: int, problem: str, open_: str) -> tuple[str, str]:
    tag = text[text.rfind("<", 0, at) : at]
    is_in_tag = ">" not in _without_values(tag) and not tag.startswith("<!--")
    is_in_value = is_in_tag and (tag.count('"') % 2 == 1 or tag.count("'") % 2 == 1)
    match problem:
        case "mismatched tag":
            closing = text[text.rfind("<", 0, at + 1) :].partition(">")[0].strip("</ ")
            return (
                f"`</{closing}>` is found while `<{open_}>` is still open",
                f"close it before: `</{open_}>`, or correct the name",
            )
        case "duplicate attribute":
            return "an attribute is given twice", "remove one of the two"
        case "unbound prefix":
            found = PREFIXED.search(text, max(0, at - 1))
            prefix = found[1] if found else PREFIX
            address = OF_PREFIXES.get(prefix, "...")
            return (
                f"the prefix `{prefix}` is not declared",
                f'add `xmlns:{prefix}="{address}"` to the outermost element',
            )
        case "undefined entity":
            return f"only {KNOWN} are known", "write the character itself"
        case "no element found":
            if not open_:
                return "there is no element", "write an `<scxml>` element"
            return f"`<{open_}>` is never closed", f"close it with `</{open_}>`"
    if tag.startswith("<!--"):
        return "`--` within a comment", "write one dash, or end the comment with `-->`"
    if is_in_value and "\n" in tag.rpartition('"')[2]:
        return "a quote is not closed before this line", 'close the value with `"`'
    if is_in_value and text[at : at + 1] == "<":
        return "`<` within a value", "write `&lt;`"
    if "&" in text[max(0, at - 2) : at + 1]:
        return "`&` starts the name of a character", "write `&amp;`, or in an expression `and`"
    if is_in_tag and tag.endswith("="):
        return "a value without quotes", 'put it into quotes: `name="value"`'
    if is_in_tag and tag.endswith(('"', "'")):
        return "a blank is missing between two attributes", "put a blank before this one"
    advice = f"check the markup here; `<{open_}>` is still open" if open_ else None
    return problem, advice or "write an `<scxml>` element"


def _without_values(tag: str) -> str:
    return re.sub(r"\"[^\"]*\"|'[^']*'|\"[^\"]*$", "", tag)
