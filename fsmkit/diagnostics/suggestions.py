"""Suggestions for unknown names."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from itertools import chain

LONGEST = 100
"""Longer names are not compared (in characters): the comparison takes quadratic time."""
MOST = 1_000
"""Up to this many names are compared in full; above it, only those with the same two first letters.
"""
SYNONYMS = {
    "action": ("do", "script"),
    "actions": ("do", "script"),
    "condition": ("if", "cond"),
    "always": ("invariant",),
    "cond": ("if",),
    "connections": ("connect",),
    "context": ("data", "datamodel"),
    "enter": ("entry", "onentry"),
    "entry": ("onentry",),
    "event": ("on",),
    "events": ("sends",),
    "eventually": ("leads_to", "reachable"),
    "exit": ("onexit",),
    "file": ("chart", "src"),
    "goto": ("target",),
    "guard": ("if", "cond"),
    "id": ("name",),
    "if": ("cond",),
    "instances": ("machines",),
    "leave": ("exit", "onexit"),
    "name": ("chart", "system", "id", "signature"),
    "next": ("target",),
    "on": ("event",),
    "onenter": ("entry", "onentry"),
    "parallel": ("regions",),
    "state": ("in",),
    "steps": ("cases",),
    "timeout": ("after",),
    "to": ("target",),
    "transition": ("on",),
    "trigger": ("on", "event"),
    "variables": ("data", "datamodel"),
    "vars": ("data", "datamodel"),
    "when": ("if", "cond"),
    "wires": ("connect",),
}
"""Keys, elements and attributes of other tools or of the other notation, in lower case and without
underscores, with the keys of the same meaning here. The first key that is allowed in the context is
suggested."""


def nearest_name(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most similar to `name`, or None if none is similar."""
    if len(name) > LONGEST:
        return None
    candidates = sorted(k for k in known if len(k) <= LONGEST)
    if len(candidates) > MOST:
        candidates = [k for k in candidates if k[:2] == name[:2]][:MOST]
    alike = [known for known in candidates if known.lower() == name.lower()]
    near = alike or get_close_matches(name, candidates, n=1)
    return near[0] if near else None


class NameSuggestion(str):
    """Advice that suggests ``name`` for an unknown name ``wrong``."""

    __slots__ = ("name", "wrong")
    name: str
    wrong: str


def suggest_name(name: str, wrong: str) -> NameSuggestion:
    """Return the advice to write `name` instead of `wrong`."""
    advice = NameSuggestion(f"did you mean `{name}`?")
    advice.name, advice.wrong = name, wrong
    return advice


def suggest_key(name: str, known: Collection[str], otherwise: str) -> str:
    """Suggest a key for one that is not allowed: a synonym, else a similar name."""
    near = find_synonym(name, known) or nearest_name(name, known)
    return suggest_name(near, name) if near else otherwise


def find_synonym(name: str, known: Iterable[str]) -> str | None:
    """Return the known key that is a synonym; case, ``_`` and prefixes are ignored."""
    by_form = {word.rpartition(":")[2]: word for word in known}
    key = name.rpartition(":")[2].replace("_", "").replace("-", "").lower()
    same = (word for form, word in by_form.items() if form.lower() == key)
    synonyms = (by_form[word] for word in SYNONYMS.get(key, ()) if word in by_form)
    return next(chain(same, synonyms), None)


def suggest(name: str, known: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return ``did you mean `...`?`` for the nearest known name, else ``otherwise``."""
    near = nearest_name(name, known)
    return suggest_name(near, name) if near else otherwise
