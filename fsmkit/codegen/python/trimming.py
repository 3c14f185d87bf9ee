"""The text of `fsmkit.runtime.python` for one chart, without the parts that it does not need.

Conditions in the text name mechanisms (`codegen.conditional`): a line ``# if DEFERRAL`` and its
``# endif`` hold what only a machine that defers needs. Assignments to private attributes that no
remaining definition reads are dropped as well.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property, lru_cache

from fsmkit.chart.statements import Destination
from fsmkit.codegen.conditional import Facts, selected
from fsmkit.codegen.python.lines import Piece, Uses
from fsmkit.plan import Features
from fsmkit.plan.image import Image

TRACE = ("trace", "_cause")
"""Variables that only the trace needs."""
_TRACES = re.compile(r"( *)if (?:(.+) and )?(?:self|child)\.trace is not None:$")
"""The head of statements for the trace: recorded machines execute them without a trace, too."""


def facts_of(
    features: Features,
    image: Image | None,
    *,
    traced: bool,
    recorded: bool,
    covered: bool,
    saved: bool,
) -> Facts:
    """Return the mechanisms of a machine that neither invokes nor is invoked."""
    delays = features.delays
    return {
        "TRACED": traced,
        "RECORDED": recorded,
        "RECORD_SAVES": saved,
        "COVERED": covered,
        "TIMED": features.timeouts or bool(delays),
        "TIMEOUTS": features.timeouts,
        "DELAYS": bool(delays),
        "DELAYS_INTERNAL": Destination.INTERNAL in delays,
        "DELAYS_PORT": Destination.PORT in delays,
        "DELAYS_SELF": Destination.SELF in delays,
        "PERIODS": features.periods,
        "TIMED_GUARDS": features.timed_guards,
        "ALTERNATIVES": features.alternatives,
        "REGIONS": features.regions,
        "INTERNAL": features.raises or features.fails or Destination.INTERNAL in delays,
        "DEFERRAL": features.deferral,
        "SAMPLES_INPUTS": features.samples_inputs,
        "CALLS_HOST": traced or features.calls or features.logs,
        "ERROR_FAULTS": features.error_faults,
        "PAYLOAD": features.payload,
        "SLOTS": False,
        "DEFERRABLE": image is not None and bool(image.deferred),
        "ARMED": image is not None and bool(image.timers),
    }


def facts_of_family(*, recorded: bool, covered: bool, saved: bool) -> Facts:
    """Return the mechanisms of machines that invoke each other: all but the optional ones."""
    optional = {"RECORDED": recorded, "COVERED": covered, "RECORD_SAVES": saved}
    return defaultdict(lambda: True, optional)


def needed_lines(text: str, facts: Facts) -> Iterator[str]:
    """Yield the lines of a definition that a machine needs."""
    head: tuple[int, bool] | None = None
    """For trace statements: the indentation, and whether they are kept."""
    for line in selected(text.split("\n"), facts):
        inset = len(line) - len(line.lstrip())
        if head is not None and inset <= head[0]:
            head = None
        found = _TRACES.match(line)
        if head is not None:
            if facts["TRACED"]:
                yield line if head[1] else line[4:]
        elif found is None:
            yield line
        else:
            head = inset, not facts["RECORDED"] or found[2] is not None
            if facts["TRACED"] and head[1]:
                yield f"{found[1]}if {found[2]}:" if facts["RECORDED"] else line


def uses_of(tree: ast.AST) -> Uses:
    """Return the names that a definition of the library reads."""
    names: set[str] = set()
    attributes: set[str] = set()
    own: set[str] = set()
    for part in ast.walk(tree):
        if isinstance(part, ast.Attribute):
            attributes |= {part.attr} if isinstance(part.ctx, ast.Load) else set()
        elif isinstance(part, ast.Name):
            names.add(part.id)
            own |= set() if isinstance(part.ctx, ast.Load) else {part.id}
        elif isinstance(part, ast.arg):
            own.add(part.arg)
    return Uses(frozenset(names | attributes), frozenset(names - own))


@dataclass(frozen=True, eq=False)
class TrimmedMethod:
    """A method or a table, without the parts that its machine does not need."""

    name: str
    text: str

    @cached_property
    def _tree(self) -> ast.stmt:
        return ast.parse(self.text).body[0]

    @cached_property
    def uses(self) -> Uses:
        """The names that it reads: variables, and attributes of any object."""
        return uses_of(self._tree)

    @property
    def names(self) -> frozenset[str]:
        """All names that it reads."""
        return self.uses.names

    @cached_property
    def _stored(self) -> frozenset[str]:
        """The private attributes that it assigns."""
        names = {name for _, stored in _stores(self._tree) for name in stored}
        return frozenset(name for name in names if name.startswith("_") or name in TRACE)

    def without_stores(self, read: AbstractSet[str]) -> TrimmedMethod:
        """Return the method without assignments to private attributes that nothing reads."""
        dead = self._stored - read
        return _without_stores(self, dead) if dead else self


def _stores(tree: ast.AST) -> Iterator[tuple[ast.stmt, list[str]]]:
    """Yield the assignments to attributes only, with the names of these."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AugAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [each.attr for each in targets if isinstance(each, ast.Attribute)]
            if len(names) == len(targets):
                yield node, names


@lru_cache(maxsize=1 << 12)
def _without_stores(method: TrimmedMethod, dead: frozenset[str]) -> TrimmedMethod:
    tree = ast.parse(method.text).body[0]
    gone = {node for node, names in _stores(tree) if dead.issuperset(names)}
    choices = [node for node in ast.walk(tree) if isinstance(node, ast.If)]
    gone.update(node for node in choices if gone.issuperset(node.body) and not node.orelse)
    if not gone:
        return method
    lines = {line for node in gone for line in range(node.lineno, (node.end_lineno or 0) + 1)}
    kept = (text for n, text in enumerate(method.text.split("\n"), 1) if n not in lines)
    return TrimmedMethod(method.name, "\n".join(kept))


def trimmed_method(method: Piece, facts: Facts) -> TrimmedMethod:
    """Return a method as a machine with these mechanisms needs it."""
    return _trimmed(method.name, "\n".join(needed_lines(method.text, facts)))


@lru_cache(maxsize=1 << 12)
def _trimmed(name: str, text: str) -> TrimmedMethod:
    return TrimmedMethod(name, text)
