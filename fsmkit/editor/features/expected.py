"""Find the tokens and the type that the grammar accepts after a partial expression."""

from __future__ import annotations

import re
from functools import lru_cache

from lark.exceptions import LarkError

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.expressions import ExpressionReader
from fsmkit.language.syntax import LONGEST, SyntaxFault, parser

COMPARED = re.compile(r"([\w.\[\]$]+)\s*(?:==|!=|<=|>=|<|>)\s*\w*$")
LAST_WORD = re.compile(r"[\w$]*$")


def hint_before(chart: ChartNames, events: tuple[str, ...] | None, text: str) -> str | None:
    """Return the enumeration that the end of a source is compared with, or None."""
    match = COMPARED.search(text)
    if match is None:
        return None
    at_hand = tuple(chart.event(name) for name in events or ())
    reader = ExpressionReader(chart, lambda _: None, at_hand)
    written = match[1]
    return reader.hint_of(Text(written, Span(Source("", written), 0, len(written))))


@lru_cache(maxsize=1_000)
def after_expression(text: str) -> bool:
    """Return whether an operator must follow a complete operand: ``a == b |``.

    Return False for a source that is not the start of an expression.
    """
    before = text[: len(text) - len(LAST_WORD.search(text)[0])]  # type: ignore[index]
    if not before.strip() or len(before) > LONGEST:
        return False
    state = parser().parse_interactive(before, start="expression")
    try:
        state.exhaust_lexer()
        accepted = state.accepts()  # type: ignore[no-untyped-call]
    except (LarkError, SyntaxFault):
        return False
    return "NAME" not in accepted and bool(accepted)
