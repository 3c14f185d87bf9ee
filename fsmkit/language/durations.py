"""Spans of time as text, and in ticks."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and gives up)

from __future__ import annotations

import re
from fractions import Fraction

from fsmkit.diagnostics import Span, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.language.names import Context
from fsmkit.language.types import LONGEST_DURATION
from fsmkit.language.units import MEANT, MICROSECONDS, meant, no_unit

WRITTEN = re.compile(r"(\d{1,18}\.?\d{0,18}|\.\d{1,18})\s*(us|ms|s|m|h|d)?")
WITH_A_WORD = re.compile(r"(\d{1,18}\.?\d{0,18}|\.\d{1,18})\s*([^\W\d]{1,18})")


def duration_of(context: Context, written: str, at: Span | Text) -> int | None:
    """Return the ticks of a duration such as ``500ms``, ``1.5s``, ``.5s``; report what is none.

    A number without a unit is milliseconds in dialects other than fsmkit, with a warning.
    """
    match = WRITTEN.fullmatch(written.strip())
    worded = WITH_A_WORD.fullmatch(written.strip())
    if match is None and worded is not None:
        message = no_unit(worded[2])
        unit = MEANT.get(worded[2].lower())
        fixes = replace_text(at, f"{worded[1]}{unit}") if unit else ()
        return context.report(
            "invalid-duration", message, at, meant(worded[1], worded[2]), fixes=fixes
        )
    if match is None:
        return context.report(
            "invalid-duration", f"`{written}` is no duration", at, "write such as `500ms` or `1.5s`"
        )
    number, unit = match[1], match[2]
    if unit is None and context.scope.dialect == "fsmkit":
        advice = f"give it a unit: `{number}ms`, `{number}s`"
        fixes = (*replace_text(at, f"{number}ms"), *replace_text(at, f"{number}s"))
        message = f"`{number}` has no unit"
        return context.report("invalid-duration", message, at, advice, fixes=fixes)
    if unit is None:
        message = f"`{number}` has no unit: taken as milliseconds"
        fixes = replace_text(at, f"{number}ms", sure=True)
        context.report("duration-without-unit", message, at, f"write `{number}ms`", fixes=fixes)
    ticks = Fraction(number) * MICROSECONDS[unit or "ms"] / context.scope.tick
    if ticks.denominator != 1:
        tick = spelled(1, context.scope.tick)
        return context.report(
            "invalid-duration",
            f"`{written}` is no whole number of ticks of {tick}",
            at,
            "write a multiple of the tick, or make the tick finer under `capacity`",
        )
    if ticks > LONGEST_DURATION:
        longest = spelled(LONGEST_DURATION, context.scope.tick)
        return context.report(
            "invalid-duration",
            f"`{written}` is longer than {longest}",
            at,
            "write a shorter one, or make the tick coarser under `capacity`",
        )
    return int(ticks)


def spelled(ticks: int, tick: int) -> str:
    """Return a number of ticks of so many microseconds as text, in the largest unit that divides.

    That is at most seconds, as people write it.
    """
    microseconds = ticks * tick
    unit = next(u for u in ("s", "ms", "us") if microseconds % MICROSECONDS[u] == 0)
    return f"{microseconds // MICROSECONDS[unit]}{unit}"
