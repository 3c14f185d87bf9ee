"""Durations: reading them as ticks, and formatting ticks."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

import re
from fractions import Fraction

from fsmkit.diagnostics import Span, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.language.names import Context
from fsmkit.language.types import LONGEST_DURATION
from fsmkit.language.units import MEANT, MICROSECONDS, suggest_duration, unknown_unit

WRITTEN = re.compile(r"(\d{1,18}\.?\d{0,18}|\.\d{1,18})\s*(us|ms|s|m|h|d)?")
WITH_A_WORD = re.compile(r"(\d{1,18}\.?\d{0,18}|\.\d{1,18})\s*([^\W\d]{1,18})")


def duration_of(context: Context, written: str, at: Span | Text) -> int | None:
    """Return the ticks of a duration such as ``500ms``, ``1.5s``, ``.5s``; report an invalid one.

    A number without a unit is milliseconds in dialects other than fsmkit, with a warning.
    """
    match = WRITTEN.fullmatch(written.strip())
    worded = WITH_A_WORD.fullmatch(written.strip())
    if match is None and worded is not None:
        message = unknown_unit(worded[2])
        unit = MEANT.get(worded[2].lower())
        fixes = replace_text(at, f"{worded[1]}{unit}") if unit else ()
        return context.report(
            "invalid-duration", message, at, suggest_duration(worded[1], worded[2]), fixes=fixes
        )
    if match is None:
        return context.report(
            "invalid-duration",
            f"`{written}` is not a duration",
            at,
            "write such as `500ms` or `1.5s`",
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
        tick = format_ticks(1, context.scope.tick)
        return context.report(
            "invalid-duration",
            f"`{written}` is not a whole number of ticks of {tick}",
            at,
            "write a multiple of the tick, or make the tick finer under `capacity`",
        )
    if ticks > LONGEST_DURATION:
        longest = format_ticks(LONGEST_DURATION, context.scope.tick)
        return context.report(
            "invalid-duration",
            f"`{written}` is longer than {longest}",
            at,
            "write a shorter one, or make the tick coarser under `capacity`",
        )
    return int(ticks)


def format_ticks(ticks: int, tick: int) -> str:
    """Format `ticks` of `tick` microseconds each, in the largest exact unit up to seconds."""
    microseconds = ticks * tick
    unit = next(u for u in ("s", "ms", "us") if microseconds % MICROSECONDS[u] == 0)
    return f"{microseconds // MICROSECONDS[unit]}{unit}"
