"""Changes of the small texts in a chart, token by token, with the words of the language."""

from __future__ import annotations

import re
from collections.abc import Sequence
from random import Random

TOKEN = re.compile(r"\s+|\d[\w.]*|[^\W\d][\w.]*|\"[^\"\n]*\"|'[^'\n]*'|[=!<>&|*+/-]+|.", re.DOTALL)


def _split(text: str) -> tuple[str, ...]:
    return tuple(text.split())


SIGNS = _split(
    "+ - * / % // ** << >> >>> & | ^ ~ ! && || == != === !== < <= > >= ? : = += -= *= /= ++ -- "
    "( ) [ ] { } , ; . .. not and or in if else for"
)
WORDS = _split(
    "true false null undefined NaN Infinity super typeof void new instanceof None True False "
    "min max abs len In event event.n event.data _event _event.data _event.data.n _event.name "
    "_sessionid _name _ioprocessors _x this raise send to after as type content with cancel "
    "reply log wrap fault bool int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 "
    "float64 symbol duration 1ms 1.5s .5s 0ms 1us 3h 99999d error.execution done.state.a "
    "error.* * e.* error.range"
)
NUMBERS = _split(
    "0 1 -1 2 3 7 8 31 32 63 64 127 128 255 256 -128 -129 65535 65536 2147483647 2147483648 "
    "-2147483648 4294967295 4294967296 9007199254740993 9223372036854775807 9223372036854775808 "
    "-9223372036854775808 18446744073709551615 18446744073709551616 1e9 1e308 1e309 0.1 1.5 "
    "-0.0 1e-400 0x7f 0b11 0o17 1_000 00 99999999999999999999999999"
)
TYPES = _split(
    "bool int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64 symbol duration "
    "0..3 0..0 -1..1 5..2 0..18446744073709551615 -9223372036854775808..9223372036854775807 "
    "0..9wrap 0..9fault uint8[4] bool[1] 0..3[0] uint8[65535] symbol[2] uint8[2][2] Fault Point "
    "Fault[3]"
)
FORMS = (
    "({})", "-{}", "!({})", "not {}", "{} + 1", "{} / 2", "{} % 0", "1 << {}", "{} == 'a'",
    "{} ? 1 : 2", "{} if {} else 0", "min({}, 3)", "max({}, 1.5)", "abs({})", "len({})", "[{}]",
    "[{}, {}]", "{}[0]", "{}[9]", "{}.n", "In({})", "In('a')", "{} && {}", "{} or {}",
    "x = {}", "{} = 1", "{}; {}", "{}\n{}", "if {} {{ x = 1 }} else {{ {} }}",
    "for y in {} {{ x = y }}", "for y, i in {} {{ {} }}", "raise e(n = {})", "raise {}",
    "send e after {}", "send ({}) to ({}) after ({}) as i", "send e to peer type ({}) with x",
    "send e content {}", "cancel ({})", "reply {}", "log {}, 'a', {}", "goto({})", "e(n {})",
    "{} = {}", "{}[4] = 1", "{}..{}", "{} wrap = 0", "goto(n {}) -> bool",
)  # fmt: skip
"""All forms of expressions, statements and declarations, around a source."""


def pick(random: Random, *pools: Sequence[str]) -> str:
    """Return a word of one of the pools, each pool equally likely."""
    filled = [pool for pool in pools if pool]
    return random.choice(random.choice(filled)) if filled else ""


def word(random: Random, names: Sequence[str]) -> str:
    """Return a word of the language, a number, a sign, or a name that the chart has."""
    return pick(random, names, names, WORDS, NUMBERS, SIGNS, TYPES)


def changed(text: str, random: Random, names: Sequence[str]) -> str:
    """Return a source that differs in one or two tokens, or is part of a larger one."""
    if random.random() < 0.3:
        return random.choice(FORMS).replace("{}", text or word(random, names), 1).replace(
            "{}", word(random, names)
        ).replace("{{", "{").replace("}}", "}")  # fmt: skip
    tokens = TOKEN.findall(text)
    at = random.randrange(len(tokens) + 1)
    match random.randrange(5):
        case 0 | 1:
            tokens[at : at + 1] = [word(random, names)]
        case 2:
            tokens[at:at] = [" ", word(random, names), " "]
        case 3:
            del tokens[at : at + random.randint(1, 3)]
        case _:
            end = random.randrange(at, len(tokens) + 1)
            to = random.randrange(len(tokens) + 1)
            tokens[to:to] = [" ", *tokens[at:end][:40], " "]
    return "".join(tokens)
