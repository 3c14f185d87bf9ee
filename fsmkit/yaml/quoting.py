"""When a text can stand in YAML as it is, and how it is quoted where it cannot."""

from __future__ import annotations

import json
import re

INDICATORS = "!&*\"'[]{}|>%@`#,"
"""No plain text begins with one of these (YAML 1.2, 5.3)."""
UNPRINTABLE = re.compile(
    r"[^\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
SPLIT = re.compile(r": | #|:$|^[-?:]( |$)|^\s|\s$|^(---|\.\.\.)|^$")
FLOW_SPLIT = re.compile(r"[,?\[\]{}]|^[-:]|:[,\[\]{}]")


def is_plain(text: str, *, in_flow: bool = False) -> bool:
    """Whether a text reads back as itself without quotes, in flow style or out of it."""
    return not (
        UNPRINTABLE.search(text)
        or text[:1] in INDICATORS
        or SPLIT.search(text)
        or text in ("<<", "=")
        or (in_flow and FLOW_SPLIT.search(text))
    )


def scalar(text: str, *, in_flow: bool = False) -> str:
    """Return a text as a scalar of one line, quoted only where it must be."""
    return text if is_plain(text, in_flow=in_flow) else quoted(text)


def quoted(text: str) -> str:
    """Return a text in quotes, in single ones where that saves escapes."""
    if UNPRINTABLE.search(text):
        # JSON is a subset of YAML, except that it writes astral characters as surrogates
        return UNPRINTABLE.sub(_escaped, json.dumps(text, ensure_ascii=False))
    if '"' in text or "\\" in text:
        return "'" + text.replace("'", "''") + "'"
    return f'"{text}"'


def _escaped(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
