"""Actions on findings: declare a name that is not known, and allow a rule where it was found."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from fsmkit.diagnostics import Diagnostic, Edit, Fix, Severity, Source, Span
from fsmkit.diagnostics.allow_comments import is_hidden
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.editor.context import Context
from fsmkit.editor.features.adding import declaration
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.files import Kind

UNKNOWN = re.compile(r"(unknown name|unknown operation|there is no event) `([A-Za-z_][\w.]*)`")
NUMBER = r"-?\d+(?:\.\d+)?"
VALUE_BEFORE = re.compile(r"(?:\bif:?|cond=[\"']|=|\band|\bor|\bnot|[(!<>+*/-])\s*[\"']?$")
MEMBER = re.compile(r"([A-Z]\w*)\.([A-Za-z_]\w*)")


def declaration_fixes(context: Context, path: Path, finding: Diagnostic) -> Iterator[Fix]:
    """Yield fixes that declare an unknown name, the most likely first."""
    match = UNKNOWN.match(finding.message)
    file, names = context.workspace.file(path), context.workspace.chart(path)
    if match is None or finding.primary is None or file is None or file.kind is not Kind.CHART:
        return
    source, span, name = file.source, finding.primary.span, match[2]
    if span.source.text != source.text or names is None:
        return
    kinds: list[tuple[str, str, str, str]] = []
    if match[1] == "there is no event":
        kinds = [("in", name, "", "incoming event"), ("internal", name, "", "internal event")]
    elif match[1] == "unknown operation":
        kinds = [("operations", f"{name}({_parameters(source, span, names)})", "", "operation")]
        if _is_value(source, span):
            kinds = [("operations", f"{kinds[0][1]} -> bool", "", "operation")]
    elif "." not in name:
        type_, start = inferred(source, span, names)
        kinds = [("data", name, f"{type_} = {start}", f"data, `{type_}`")]
        if not _is_assigned(source, span):
            kinds.append(("inputs", name, type_, f"input, `{type_}`"))
            kinds.append(("constants", name, start, "constant"))
    for section, declared, value, what in kinds:
        edits = declaration(source, section, declared, value)
        if edits:
            yield Fix(f"Declare `{name}` as {what}", edits)


def inferred(source: Source, span: Span, names: ChartNames) -> tuple[str, str]:
    """Return the type that the use of a name suggests, and a start value of it."""
    after = source.text[span.end : span.end + 80].split("\n")[0]
    before = source.text[max(0, span.start - 80) : span.start].rpartition("\n")[2]
    beyond = rf"\s*(?:[-+*/%]?=(?!=)|==|!=|[<>]=?|&lt;=?|&gt;=?|[-+*/%])\s*({NUMBER}|[\w.]+)"
    ahead = rf"({NUMBER}|[\w.]+)\s*(?:==|!=|[<>]=?|&lt;=?|&gt;=?|[-+*/%])\s*$"
    found = re.match(beyond, after) or re.search(ahead, before)
    other = found[1] if found is not None else ""
    if other in ("true", "false") or not other:
        return "bool", "false"
    if (member := MEMBER.fullmatch(other)) is not None and member[1] in names.members:
        return member[1], next(f"{member[1]}.{one}" for one in names.members[member[1]])
    symbol = names.values.get(other)
    type_ = None if symbol is None else names.types.get(symbol)
    if type_ is not None:
        enumeration = names.enumeration(type_)
        if enumeration is not None:
            return enumeration, next(f"{enumeration}.{one}" for one in names.members[enumeration])
        lowest = re.match(rf"({NUMBER})\.\.", type_.value)
        start = "false" if type_.value.strip() == "bool" else "0"
        return type_.value.strip(), lowest[1] if lowest else start
    if "." in other and re.fullmatch(NUMBER, other):
        return "float64", "0.0"
    if other.startswith("-"):
        return "-128..127", "0"
    return ("0..255" if not other.isdecimal() or int(other) < 256 else "0..65535"), "0"


def _is_assigned(source: Source, span: Span) -> bool:
    return re.match(r"\s*[-+*/%]?=(?!=)", source.text[span.end : span.end + 20]) is not None


def _is_value(source: Source, span: Span) -> bool:
    """Return whether a call is part of an expression, so that its result is used."""
    before = source.text[max(0, span.start - 80) : span.start].rpartition("\n")[2]
    return VALUE_BEFORE.search(before) is not None


def _parameters(source: Source, span: Span, names: ChartNames) -> str:
    """Return parameters for the arguments of a call."""
    call = re.compile(r"\s*\(([^()\n]*)\)").match(source.text, span.end)
    given = [text.strip() for text in call[1].split(",")] if call and call[1].strip() else []
    found = []
    for number, text in enumerate(given):
        symbol = names.values.get(text)
        type_ = None if symbol is None else names.types.get(symbol)
        if type_ is not None:
            found.append(f"{text} {type_.value.strip()}")
        elif text in ("true", "false"):
            found.append(f"on_{number + 1} bool")
        elif (member := MEMBER.fullmatch(text)) is not None:
            found.append(f"{member[1].lower()} {member[1]}")
        else:
            found.append(f"value_{number + 1} {'-128..127' if text.startswith('-') else '0..255'}")
    return ", ".join(found)


def suppression_fixes(finding: Diagnostic) -> Fix | None:
    """Return the fix that allows the rule of a warning or note where it was found."""
    if finding.severity is Severity.ERROR or finding.primary is None:
        return None
    rule, span = finding.rule, finding.primary.span
    source, words = span.source, f"fsmkit: allow {finding.rule.name}"
    end = source.text.find("\n", span.start)
    end = len(source.text) if end < 0 else end
    start = source.text.rfind("\n", 0, span.start) + 1
    indent = re.match(r"[ \t]*", source.text[start:end])
    blanks = indent[0] if indent is not None else ""
    comment = f"<!-- {words} -->" if is_xml(source) else f"# {words}"
    places = [(end, f" {comment}" if is_xml(source) else f"  {comment}")]
    places.append((start, f"{blanks}{comment}\n"))
    for at, written in places:
        edit = Edit(Span(source, at, at), written)
        text = apply_edits(source.text, (edit,))
        moved = len(written) if at <= span.start else 0
        made = Span(Source(source.name, text), span.start + moved, span.end + moved)
        is_cut = at == end and not is_xml(source) and "#" in source.text[start:end]
        is_cut = is_cut or _is_in_tag(source.text, at)
        if not is_cut and is_hidden(rule, made):
            return Fix(f"Allow `{rule.name}` here", (edit,))
    return None


def _is_in_tag(text: str, at: int) -> bool:
    """Return whether an offset of XML is within a tag, where comments are not allowed."""
    return text.lstrip()[:1] == "<" and text.rfind("<", 0, at) > text.rfind(">", 0, at)
