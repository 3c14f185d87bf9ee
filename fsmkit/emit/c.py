"""Texts in C."""

from __future__ import annotations

from fsmkit.emit.lines import one_line

_WORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t
    char32_t char8_t class co_await co_return co_yield compl concept const const_cast consteval
    constexpr constinit continue decltype default delete do double dynamic_cast else enum
    explicit export extern false float for friend goto if inline int long mutable namespace new
    noexcept not not_eq nullptr operator or or_eq private protected public register
    reinterpret_cast requires restrict return short signed sizeof static static_assert
    static_cast struct switch template this thread_local throw true try typedef typeid typename
    typeof typeof_unqual union unsigned using virtual void volatile wchar_t while xor xor_eq
"""
WORDS = frozenset(_WORDS.split())
"""Keywords of C up to C23 and of C++ up to C++23, with `asm` and `typeof` of GNU C."""


def comment(text: str) -> str:
    """Return a string for a comment: it cannot end the comment or start a line."""
    return one_line(text).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")


def quoted(text: str) -> str:
    """Return a literal of a string."""
    return f'"{inside(text)}"'


def inside(text: str) -> str:
    """Return the content of a string literal, with octal escapes, which no digit can extend."""
    return "".join(
        chr(byte) if 32 <= byte < 127 and byte not in b'"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )


def printed(text: str) -> str:
    """Return the content of a string literal for a format of ``printf``."""
    return inside(text).replace("%", "%%")
