# ruff: noqa: RUF001  (the table holds letters that look like others)
"""Letters beyond ASCII in ASCII: the same result on each machine and in each version of Python."""

from __future__ import annotations

import unicodedata
from functools import lru_cache

_TABLE = """
    ä ae ö oe ü ue ß ss ẞ ss æ ae œ oe ø oe å aa ð d þ th ł l đ d ħ h ı i ŋ ng ə e
    а a б b в v г g д d е e ё yo ж zh з z и i й y к k л l м m н n о o п p р r с s т t у u ф f
    х kh ц ts ч ch ш sh щ shch ъ _ ы y ь _ э e ю yu я ya
    є ye і i ї yi ґ g ў w ђ dj ј j љ lj њ nj ћ c џ dz ѕ dz ѓ gj ќ kj
    α a β v γ g δ d ε e ζ z η i θ th ι i κ k λ l μ m ν n ξ x ο o π p ρ r σ s ς s τ t υ y φ f
    χ ch ψ ps ω o
"""
_WORDS = _TABLE.split()
LETTERS = {
    letter: "" if found == "_" else found
    for letter, found in zip(_WORDS[::2], _WORDS[1::2], strict=True)
}
"""Letters in lower case: Latin as in German and its neighbours, Cyrillic, Greek."""


def transliterated(text: str) -> str:
    """Return a text in ASCII: ``Tür`` gives ``Tuer``, ``пуск`` ``pusk``, ``電`` ``u96fb``.

    A letter without a transliteration and each other symbol becomes ``u`` and its code point.
    Punctuation, blanks and control characters become ``_``.
    """
    if text.isascii():
        return text
    parts = []
    composed = unicodedata.normalize("NFC", text)
    for place, char in enumerate(composed):
        found = _ascii(char)
        if len(found) > 1 and found[0].isupper():
            after = composed[place + 1 : place + 2] or composed[max(place - 1, 0) : place]
            found = found.upper() if after.isupper() else found
        parts.append(found)
    return "".join(parts)


@lru_cache(maxsize=1 << 12)
def _ascii(char: str) -> str:
    if char.isascii():
        return char
    letter = char.lower()
    if letter in LETTERS:
        return LETTERS[letter] if char == letter else LETTERS[letter].capitalize()
    spread = unicodedata.normalize("NFKD", char)
    if spread[0] != char and all(unicodedata.combining(mark) for mark in spread[1:]):
        return _ascii(spread[0])
    if spread.isascii() and spread.isalnum():  # such as a ligature or a number in a circle
        return spread
    category = unicodedata.category(char)
    return f"u{ord(char):x}" if category[0] in "LNSM" else "_"
