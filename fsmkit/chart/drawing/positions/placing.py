"""Place the boxes of a drawing where they were, and new ones near what they belong to.

A state that was drawn keeps its place. A new one is put near the source of an arrow to it, where
there is room. A composite state grows to hold its content, and what overlaps then is pushed to the
right or down, no farther than necessary.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.drawing.positions.placement import Rect

GAP = 20.0
"""Points between a state and a new or pushed one."""
TOUCH = 6.0
"""Points between two states below which one is pushed."""
NEAR = 6.0
"""Points around dots and texts of arrows."""
BELOW = 46.0
"""Points between a state and a new one below it: room for an arrow with a label."""
SLACK = 0.5
"""Points by which nothing is pushed."""
MARGIN = 10.0
"""Points between the border of a composite state and its content."""
STEP, FARTHEST = 24, 480
MOST_PUSHES = 4_000


@dataclass(frozen=True, slots=True)
class Item:
    """A box to be placed.

    ``parent`` is empty at the top. ``near`` names boxes that it should be near, the best first. A
    container has the least size of its title; ``top`` is the height of the title.
    """

    name: str
    parent: str
    width: float
    height: float
    near: tuple[str, ...] = ()
    is_container: bool = False
    is_small: bool = False
    """A dot, or the text of an arrow: not a state."""
    is_between: bool = False
    """A small box that belongs between the first two of ``near``."""
    top: float = 0
    at: tuple[float, float] | None = None
    """Where it is in its parent, from the upper left corner, if it was not drawn before."""


def place(items: Sequence[Item], old: Mapping[str, Rect]) -> dict[str, Rect]:
    """Return the rectangles of all items, which are in the order of parents before children."""
    return _Placing(items, old).run()


class _Placing:
    def __init__(self, items: Sequence[Item], old: Mapping[str, Rect]) -> None:
        self.items = {item.name: item for item in items}
        self.children: dict[str, list[str]] = {}
        for item in items:
            self.children.setdefault(item.parent, []).append(item.name)
        self.old = old
        self.boxes: dict[str, Rect] = {}

    def run(self) -> dict[str, Rect]:
        kept = [item for item in self.items.values() if self._is_kept(item)]
        for item in kept:
            self._keep(item)
        for item in self.items.values():
            self._put(item)
        for item in reversed(self.items.values()):
            if item.is_container and item.name not in self.boxes:
                self._wrap(item)
        for item in reversed(kept):
            self._grow(item.name)
            if item.is_container and not self._had_content(item.name):
                self._make_room(item.name)
        for item in kept:
            self._settle(item.name)
        for item in sorted(self.items.values(), key=lambda each: each.is_small):
            if item.name not in self.boxes and not self._put(item):
                self._add(item)
        return self.boxes

    def _put(self, item: Item) -> bool:
        """Put a new box where it belongs in its parent; return whether that is known."""
        around = Rect(0, 0, 0, 0) if not item.parent else self.boxes.get(item.parent)
        if item.at is None or item.name in self.boxes or around is None:
            return False
        x, y = around.x + item.at[0], around.y + item.at[1]
        self.boxes[item.name] = Rect(x, y, item.width, item.height)
        return True

    def _is_kept(self, item: Item) -> bool:
        """Whether an item has a place, in its parent if that has one, too."""
        box = self.old.get(item.name)
        if box is None:
            return False
        around = self.old.get(item.parent)
        return around is None or around.holds(*box.centre)

    def _keep(self, item: Item) -> None:
        box = self.old[item.name]
        if item.is_container:
            self.boxes[item.name] = replace(
                box, width=max(box.width, item.width), height=max(box.height, item.height)
            )
        else:
            self.boxes[item.name] = Rect(box.x, box.y, item.width, item.height)

    def _wrap(self, item: Item) -> None:
        """Place a new composite state around the content that it has, if all of it was drawn."""
        inner = [self.boxes.get(name) for name in self.children.get(item.name, ())]
        states = [
            self.boxes.get(name)
            for name in self.children.get(item.name, ())
            if not self.items[name].is_small
        ]
        known = [box for box in inner if box is not None]
        if not known or None in states:
            return
        left = min(box.x for box in known) - MARGIN
        top = min(box.y for box in known) - MARGIN - item.top
        right = max(max(box.right for box in known) + MARGIN, left + item.width)
        bottom = max(box.bottom for box in known) + MARGIN
        self.boxes[item.name] = Rect(left, top, right - left, bottom - top)

    def _siblings(self, name: str) -> Iterable[str]:
        parent = self.items[name].parent
        return (each for each in self.children[parent] if each != name and each in self.boxes)

    def _gap(self, one: str, other: str) -> float:
        return NEAR if self.items[one].is_small or self.items[other].is_small else GAP

    def _move(self, name: str, dx: float, dy: float) -> None:
        box = self.boxes[name]
        self.boxes[name] = replace(box, x=box.x + dx, y=box.y + dy)
        for child in self.children.get(name, ()):
            if child in self.boxes:
                self._move(child, dx, dy)

    def _grow(self, name: str) -> bool:
        """Let a container hold its content; return whether it grew."""
        box, item = self.boxes.get(name), self.items.get(name)
        if box is None or item is None or not item.is_container:
            return False
        inner = [self.boxes[child] for child in self.children.get(name, ()) if child in self.boxes]
        if not inner:
            return False
        left = min(box.x, *(each.x - MARGIN for each in inner))
        top = min(box.y, *(each.y - MARGIN - item.top for each in inner))
        right = max(box.right, *(each.right + MARGIN for each in inner))
        bottom = max(box.bottom, *(each.bottom + MARGIN for each in inner))
        self.boxes[name] = grown = Rect(left, top, right - left, bottom - top)
        return grown != box

    def _had_content(self, name: str) -> bool:
        """Whether something in a box was drawn before."""
        return any(child in self.old for child in self.children.get(name, ()))

    def _make_room(self, name: str) -> None:
        """Move what was below an opened box, or to its right, by as much as it has grown."""
        before, now = self.old[name], self.boxes[name]
        others = [(other, self.boxes[other]) for other in self._siblings(name)]
        below = [other for other, box in others if box.y >= before.bottom - 1]
        beside = [other for other, box in others if box.x >= before.right - 1]
        if any(self.boxes[other].meets(now, TOUCH) for other in beside):
            for other in beside:  # columns stay together
                self._move(other, now.right - before.right, 0.0)
        if any(self.boxes[other].meets(now, TOUCH) for other in below):
            for other in self._under(now, below):
                self._move(other, 0.0, now.bottom - before.bottom)

    def _under(self, box: Rect, others: Sequence[str]) -> list[str]:
        """Return the boxes that one pushes which grows downwards, and those that they push."""
        found: list[str] = []
        reached = [box]
        for other in sorted(others, key=lambda name: self.boxes[name].y):
            one = self.boxes[other]
            if any(each.x < one.right + GAP and one.x < each.right + GAP for each in reached):
                found.append(other)
                reached.append(one)
        return found

    def _settle(self, name: str) -> None:
        """Push siblings away from a box, and those that they meet; then the same for the parent."""
        while name:
            queue, pushes, moved = deque([name]), 0, False
            while queue and pushes < MOST_PUSHES:
                first = queue.popleft()
                for other in self._siblings(first):
                    if other == name:
                        continue
                    gap = self._gap(first, other)
                    mine, theirs = self.boxes[first], self.boxes[other]
                    push = self._kept_distance(first, other)
                    if push is None:
                        if not mine.meets(theirs, min(gap, TOUCH) - 0.1):
                            continue
                        right, down = mine.right + gap - theirs.x, mine.bottom + gap - theirs.y
                        push = (right, 0.0) if right < down else (0.0, down)
                    elif max(push) <= SLACK:
                        continue
                    self._move(other, *push)
                    queue.append(other)
                    pushes += 1
                    moved = True
            parent = self.items[name].parent
            if not self._grow(parent) and not moved:
                return
            name = parent

    def _kept_distance(self, first: str, other: str) -> tuple[float, float] | None:
        """Return the push by which a box keeps its distance from one that has grown towards it.

        None if the other was not below or to the right before; zeros if it is far enough.
        """
        if self.items[first].is_small or self.items[other].is_small:
            return None
        is_opened = self.items[first].is_container and not self._had_content(first)
        if first not in self.old or other not in self.old or is_opened:
            return None
        old, was = self.old[first], self.old[other]
        mine, theirs = self.boxes[first], self.boxes[other]
        if was.y >= old.bottom and mine.x < theirs.right and theirs.x < mine.right:
            wanted = min(max(was.y - old.bottom, TOUCH), BELOW)
            return 0.0, max(mine.bottom + wanted - theirs.y, 0.0)
        if was.x >= old.right and mine.y < theirs.bottom and theirs.y < mine.bottom:
            wanted = min(max(was.x - old.right, TOUCH), BELOW)
            return max(mine.right + wanted - theirs.x, 0.0), 0.0
        return None

    def _add(self, item: Item) -> None:
        """Put a new box near what it belongs to, and make room for it."""
        width = max(item.width, 2 * MARGIN) if item.is_container else item.width
        height = item.height + (2 * MARGIN if item.is_container else 0)
        around = self.boxes.get(item.parent)
        anchor = next((self.boxes[n] for n in item.near if n in self.boxes), None)
        if anchor is None:
            siblings = [self.boxes[each] for each in self._siblings(item.name)]
            anchor = max(siblings, key=lambda box: (box.bottom, -box.x)) if siblings else None
        top = 0.0 if around is None else around.y + self._top(item.parent) + MARGIN
        left = 0.0 if around is None else around.x + MARGIN
        if item.is_small:
            x, y = self._near(item, anchor, width, height, left, top)
        elif anchor is None:
            x, y = left, top
        else:
            x, y = anchor.centre[0] - width / 2, anchor.bottom + BELOW
        self.boxes[item.name] = self._free(item, Rect(x, y, width, height), left, top)
        self._settle(item.name)

    def _top(self, name: str) -> float:
        return self.items[name].top if name in self.items else 0.0

    def _near(
        self, item: Item, anchor: Rect | None, width: float, height: float, left: float, top: float
    ) -> tuple[float, float]:
        """Return the wish of a small box: between its two neighbours, or above the only one."""
        if anchor is None:
            return left, top
        others = [self.boxes[name] for name in item.near[1:2] if name in self.boxes]
        if item.is_between and others:
            x, y = others[0].centre
            x = min(max(x, anchor.x), anchor.right) - width / 2
            if others[0].y >= anchor.bottom:
                return x, anchor.bottom + 3 * NEAR
            if others[0].bottom <= anchor.y:
                return x, anchor.y - 3 * NEAR - height
            side = anchor.right + 3 * NEAR
            return (side if others[0].x >= anchor.right else anchor.x - 3 * NEAR - width), y
        x, y = anchor.centre[0] - width / 2, anchor.y - 3 * NEAR - height
        return (x, y) if y >= top else (anchor.x - 3 * NEAR - width, anchor.y)

    def _free(self, item: Item, wish: Rect, left: float, top: float) -> Rect:
        """Return the free rectangle next to a wish that makes the parent grow least."""
        around = self.boxes.get(item.parent)
        if around is None:
            all_ = [self.boxes[each] for each in self._siblings(item.name)]
            right = max((box.right for box in all_), default=0.0)
            bottom = max((box.bottom for box in all_), default=0.0)
        else:
            right, bottom = around.right - MARGIN, around.bottom - MARGIN
        taken = [(self._gap(item.name, n), self.boxes[n]) for n in self._siblings(item.name)]
        best, cost = None, float("inf")
        for distance, dx, dy in MOVES:
            if distance >= cost:
                break
            there = replace(wish, x=max(wish.x + dx, left), y=max(wish.y + dy, top))
            growth = max(there.right - right, 0) + max(there.bottom - bottom, 0)
            if distance + growth >= cost:
                continue
            if not any(there.meets(box, gap) for gap, box in taken):
                best, cost = there, distance + growth
        if best is not None:
            return best
        return replace(wish, x=max(wish.x, left), y=max(bottom + GAP, top))


MOVES = sorted(
    ((dx * dx + dy * dy) ** 0.5, float(dx), float(dy))
    for dx in range(-FARTHEST, FARTHEST + 1, STEP)
    for dy in range(-FARTHEST, FARTHEST + 1, STEP)
)
"""All ways to move a new box, the shortest first."""
