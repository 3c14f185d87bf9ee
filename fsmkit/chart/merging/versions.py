"""Three-way merge of single values and of ordered items, and the conflicts that it finds."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from fsmkit.diagnostics import Span

T = TypeVar("T")
K = TypeVar("K", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two changes that exclude each other: what is wrong, and where it is in both versions.

    ``base``: where an item was that a version removed.
    """

    message: str
    ours: Span | None = None
    theirs: Span | None = None
    base: Span | None = None


@dataclass(slots=True)
class Conflicts:
    """The conflicts that were found so far."""

    found: dict[Conflict, None] = field(default_factory=dict)

    def add(
        self,
        message: str,
        ours: Span | None = None,
        theirs: Span | None = None,
        base: Span | None = None,
    ) -> None:
        """Add a conflict, unless it is already present."""
        self.found[Conflict(message, ours, theirs, base)] = None


@dataclass(frozen=True, slots=True)
class Versions(Generic[T]):
    """The three versions of a value."""

    base: T
    ours: T
    theirs: T

    @property
    def merged(self) -> T:
        """The version that changed; ours if both changed, whether alike or differently."""
        is_theirs = self.ours == self.base and self.theirs != self.base
        return self.theirs if is_theirs else self.ours

    @property
    def is_conflict(self) -> bool:
        """Whether both versions changed differently."""
        return self.ours not in (self.base, self.theirs) and self.theirs != self.base


def merged_order(
    base: Sequence[K],
    ours: Sequence[K],
    theirs: Sequence[K],
    members: Iterable[K],
    group: Callable[[K], object] = lambda _: None,
) -> tuple[list[K], bool]:
    """Return the merged members of three sequences in their order.

    New members follow the member that they follow in their version. Where members of both versions
    follow the same one, those of its group come first, and ours precede theirs.

    Returns:
        The order, and whether both versions reordered the same members differently.

    """
    wanted = set(members)
    common = wanted & set(base) & set(ours) & set(theirs)
    orders = Versions(*([k for k in keys if k in common] for keys in (base, ours, theirs)))
    is_theirs = orders.ours == orders.base != orders.theirs
    first, second = (theirs, ours) if is_theirs else (ours, theirs)
    result = [key for key in first if key in wanted]
    known = set(second)

    def is_nearer(key: K, other: K, anchor: K | None) -> bool:
        """Return whether a new key stays nearer to its anchor than a key that is there."""
        if anchor is not None:
            is_like, is_other_like = (group(one) == group(anchor) for one in (key, other))
            if is_like != is_other_like:
                return is_like
        if other in known:  # it moved here, and precedes the new key in the version of that
            return False
        return is_theirs if anchor is not after else not is_theirs

    for number, key in enumerate(second):
        if key not in wanted or key in result:
            continue
        earlier, later = second[:number], second[number + 1 :]
        before = next((one for one in reversed(earlier) if one in result), None)
        after = next((one for one in later if one in result), None)
        if before is None and after is not None:
            at = result.index(after)
            while at and result[at - 1] not in known and not is_nearer(key, result[at - 1], after):
                at -= 1
        else:
            alike = [one for one in earlier if one == before or group(one) == group(key)]
            at = max((result.index(one) + 1 for one in alike if one in result), default=0)
            while (
                at < len(result)
                and (result[at] in earlier or result[at] not in known)
                and not is_nearer(key, result[at], before)
            ):
                at += 1
        result.insert(at, key)
    return result, orders.is_conflict
