"""Expand indices of machine arrays: ``phil[i].left -> fork[(i+1) % 3].take``, for each ``i``.

An index that is a plain name (``phil[i]``) ranges over that array; elsewhere in the same text the
name is the number. Quantifiers of properties (``all``, ``any``, ``count``) are expanded in the same
manner. The result contains only numbers, each with its location.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.language import Literal, Scope, fold, type_expression
from fsmkit.system.machine import Machine

MOST_ELEMENTS = 16384
"""Elements of an array of machines; as many machines as a system may have."""
MOST_TERMS = MOST_ELEMENTS
"""Terms that a quantifier is written out to."""

NAME = r"[A-Za-z_]\w*"
INDEXED = rf"{NAME}(?:\s*\[[^\[\]]*\])?"
"""A machine: its name, or an element of an array."""
ELEMENT = re.compile(rf"\s*({NAME})\s*\[([^\[\]]*)\]\s*")
DECLARED = re.compile(rf"\s*({NAME})\s*\[\s*({NAME})\s+in\s+(.+?)\.\.(.+?)\s*\]\s*")
BOUND = re.compile(rf"(?<![\w.])({NAME})\s*\[\s*({NAME})\s*\]")
QUANTIFIER = re.compile(rf"(?<![\w.])(all|any|count)\s*\(\s*({NAME})\s+in\s+([^:()]*?)\s*:")
KEPT = r"\"[^\"]*\"|'[^']*'|(?<!\w)In\s*\(\s*[A-Za-z_][\w.]*\s*\)"
"""Quoted texts, and tests of a state, in which no name is an index."""
JOINED_BY = {"all": " and ", "any": " or ", "count": " + "}

Bindings = Mapping[str, int]


def integer(text: Text, findings: Findings, bindings: Bindings | None = None) -> int | None:
    """Return the value of a constant expression over indices; None after a finding."""
    text = substitute_indices(text, bindings or {}).strip()
    own = Findings()
    expression = type_expression(text, Scope(), own)
    folded = None if expression is None else fold(expression)
    if isinstance(folded, Literal) and type(folded.value) is int:
        return folded.value
    findings.extend(own)
    if not own.has_errors:
        findings.add(
            "bad-index",
            f"`{text}` is not a known number",
            text,
            help="use numbers and the index names of arrays of machines",
        )
    return None


def index_range(low: Text, high: Text, findings: Findings) -> range | None:
    """Return the range ``low..high`` of an index."""
    first, last = integer(low, findings), integer(high, findings)
    if first is None or last is None:
        return None
    if first < 0 or last < first or last - first >= MOST_ELEMENTS:
        findings.add(
            "bad-index",
            f"an index cannot run over `{low.strip()}..{high.strip()}`",
            low.strip(),
            help=f"write `0..n`; at most {MOST_ELEMENTS} values",
        )
        return None
    return range(first, last + 1)


def arrays_of(machines: Sequence[Machine]) -> dict[str, range]:
    """Return the arrays among the machines, with the range of each."""
    found: dict[str, list[int]] = {}
    for machine in machines:
        if machine.place is not None:
            found.setdefault(machine.place[0], []).append(machine.place[1])
    return {name: range(places[0], places[-1] + 1) for name, places in found.items()}


def expand_indices(text: Text, machines: Sequence[Machine]) -> Iterator[Text]:
    """Yield a text once for all values of the indices in it, with numbers in their place.

    A name that indexes several arrays runs over the range of the first of them.
    """
    arrays = arrays_of(machines)
    runs: dict[str, range] = {}
    for match in BOUND.finditer(text.value):
        if match[1] in arrays:
            runs.setdefault(match[2], arrays[match[1]])
    for values in product(*runs.values()):
        yield substitute_indices(text, dict(zip(runs, values, strict=True)))


def canonical_name(name: Text, findings: Findings) -> str | None:
    """Return ``fork[2]`` for ``fork[(1+1) % 3]``, and a name that has no index as it is."""
    match = ELEMENT.fullmatch(name.value)
    if match is None:
        return name.value.strip()
    index = integer(name.part(*match.span(2)), findings)
    return None if index is None else f"{match[1]}[{index}]"


# --- writing out ----------------------------------------------------------------------------------


def substitute_indices(text: Text, bindings: Bindings) -> Text:
    """Replace the names of indices in a text by numbers; each keeps the location of the name.

    The argument of ``In`` is the name of a state, which may be equal to that of an index.
    """
    if not bindings:
        return text
    names = "|".join(map(re.escape, bindings))
    pattern = re.compile(rf"{KEPT}|(?<![\w.])({names})(?!\w)")
    parts: list[Text] = []
    at = 0
    for match in pattern.finditer(text.value):
        if match[1] is None:
            continue
        number = str(bindings[match[1]])
        parts += [text.part(at, match.start()), text_at(number, text.part(*match.span()))]
        at = match.end()
    return join_texts((*parts, text.part(at, len(text.value))), text.span) if parts else text


def text_at(value: str, at: Text) -> Text:
    """Return ``value`` with the location of ``at`` for each of its characters."""
    last = at.span_of(len(at.value) - 1, len(at.value)).start
    first = at.span_of(0, 1).start
    return Text(value, at.span, tuple(min(first + n, last) for n in range(len(value))))


def join_texts(parts: Sequence[Text], span: Span) -> Text:
    """Join texts; each character keeps its location."""
    offsets = tuple(offset for part in parts for offset in part.character_offsets())
    return Text("".join(part.value for part in parts), span, offsets)


def expand_quantifiers(text: Text, machines: Sequence[Machine], findings: Findings) -> Text | None:
    """Expand the quantifiers of a condition; None after a finding."""
    match = QUANTIFIER.search(text.value)
    if match is None:
        return text
    end = _closing_bracket(text.value, match.end())
    runs = _quantifier_range(text.part(*match.span(3)), machines, findings)
    if end is None:
        findings.add(
            "expression-syntax",
            f"`{match[1]}(` is never closed",
            text.part(*match.span(1)),
            help=f"write `{match[1]}({match[2]} in 0..2: ...)`",
        )
    if end is None or runs is None:
        return None
    keyword = text.part(*match.span(1))
    inner = expand_quantifiers(text.part(match.end(), end), machines, findings)
    rest = expand_quantifiers(text.part(end + 1, len(text.value)), machines, findings)
    if inner is None or rest is None:
        return None
    if len(runs) * len(inner.value) > MOST_TERMS * 64:
        findings.add("expression-too-deep", "this is too long when written out", keyword)
        return None
    terms = [
        _term(match[1], substitute_indices(inner, {match[2]: value}), keyword) for value in runs
    ]
    whole = _balanced_tree(terms, text_at(JOINED_BY[match[1]], keyword), keyword)
    return join_texts((text.part(0, match.start()), whole, rest), text.span)


def _term(quantifier: str, body: Text, keyword: Text) -> Text:
    left, right = ("((", ") ? 1 : 0)") if quantifier == "count" else ("(", ")")
    return join_texts((text_at(left, keyword), body, text_at(right, keyword)), body.span)


def _balanced_tree(terms: Sequence[Text], between: Text, keyword: Text) -> Text:
    """Join terms as a balanced tree."""
    if len(terms) == 1:
        return terms[0]
    half = len(terms) // 2
    left, right = (_balanced_tree(part, between, keyword) for part in (terms[:half], terms[half:]))
    parts = (text_at("(", keyword), left, between, right, text_at(")", keyword))
    return join_texts(parts, keyword.span)


def _quantifier_range(text: Text, machines: Sequence[Machine], findings: Findings) -> range | None:
    """Return the range of a quantifier: ``lo..hi``, or the elements of an array."""
    low, dots, _ = text.value.partition("..")
    if dots:
        return index_range(
            text.part(0, len(low)), text.part(len(low) + 2, len(text.value)), findings
        )
    arrays = arrays_of(machines)
    if text.value not in arrays:
        findings.add(
            "unknown-name",
            f"there is no array of machines `{text}`",
            text,
            help="write a range, such as `0..2`, or the name of an array",
        )
        return None
    return arrays[text.value]


def _closing_bracket(text: str, start: int) -> int | None:
    depth = 0
    for place in range(start, len(text)):
        if text[place] == ")":
            if depth == 0:
                return place
            depth -= 1
        depth += text[place] == "("
    return None
