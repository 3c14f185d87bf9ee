"""Sizes and spans of time as options give them."""

from __future__ import annotations

import re

import click

SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([KMGT]?)B?", re.IGNORECASE)
SPAN = re.compile(r"(\d+(?:\.\d+)?)\s*(ms|s|m|min|h)?")
UNITS = {"": 0, "K": 10, "M": 20, "G": 30, "T": 40}
SECONDS = {"ms": 0.001, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, None: 1.0}


def read_size(ctx: click.Context, param: click.Parameter, value: str) -> int:
    """Read ``4G``, ``512M`` as bytes."""
    match = SIZE.fullmatch(value)
    if match is None:
        raise click.BadParameter(f"`{value}` is no size such as 4G or 512M", ctx, param)
    return int(float(match[1]) * (1 << UNITS[match[2].upper()]))


def read_span(ctx: click.Context, param: click.Parameter, value: str) -> float:
    """Read ``10m``, ``30s`` as seconds."""
    match = SPAN.fullmatch(value)
    if match is None:
        raise click.BadParameter(
            f"`{value}` is no duration such as 30s or 10m; units are ms, s, m, h", ctx, param
        )
    return float(match[1]) * SECONDS[match[2]]
