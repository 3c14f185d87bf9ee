"""What was probably meant by a name that is not known."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from itertools import chain

LONGEST = 100
"""Characters; longer names are not compared, for comparing takes the square of their length."""
MOST = 1_000
"""So many names are compared in full; of more only those that begin alike."""
ELSEWHERE = {
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
"""Keys, elements and attributes as other tools or the other notation call them, without case and
underscores, with what has that meaning here: the first of it that may stand where they do."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like one, None if none is."""
    if len(name) > LONGEST:
        return None
    candidates = sorted(k for k in known if len(k) <= LONGEST)
    if len(candidates) > MOST:
        candidates = [k for k in candidates if k[:2] == name[:2]][:MOST]
    alike = [known for known in candidates if known.lower() == name.lower()]
    near = alike or get_close_matches(name, candidates, n=1)
    return near[0] if near else None


class Meant(str):
    """Advice that names what was probably meant for a wrong name."""

    __slots__ = ("name", "wrong")
    name: str
    wrong: str


def did_you_mean(name: str, wrong: str) -> Meant:
    """Return the advice to write another name."""
    advice = Meant(f"did you mean `{name}`?")
    advice.name, advice.wrong = name, wrong
    return advice


def suggest_key(name: str, known: Collection[str], otherwise: str) -> str:
    """Return which key was meant by one that may not stand here: by meaning, else by form."""
    near = called_elsewhere(name, known) or nearest(name, known)
    return did_you_mean(near, name) if near else otherwise


def called_elsewhere(name: str, known: Iterable[str]) -> str | None:
    """Return the key that has the meaning of another; case, ``_`` and prefixes do not count."""
    by_form = {word.rpartition(":")[2]: word for word in known}
    wanted = name.rpartition(":")[2].replace("_", "").replace("-", "").lower()
    same = (word for form, word in by_form.items() if form.lower() == wanted)
    meant = (by_form[word] for word in ELSEWHERE.get(wanted, ()) if word in by_form)
    return next(chain(same, meant), None)


def suggest(name: str, known: Iterable[str], otherwise: str | None = None) -> str | None:
    """Return ``did you mean `...`?`` for the nearest known name, else ``otherwise``."""
    near = nearest(name, known)
    return did_you_mean(near, name) if near else otherwise
