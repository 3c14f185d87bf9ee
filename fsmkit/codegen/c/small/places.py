"""The places of states: one number for each, region by region, so that tables can be indexed."""

from __future__ import annotations

from fsmkit.plan import Plan


class Places:
    """Places from 1; 0 is the root, above all states."""

    def __init__(self, plan: Plan) -> None:
        """Give each state but histories its place."""
        self._plan = plan
        base = [0]
        for region in plan.regions:
            base.append(base[-1] + len(region.states))
        self.base = base
        """By region: the places of the regions before it; and all places."""
        self.states = [state for region in plan.regions for state in region.states]
        """The state at each place, from that of place 1."""

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.states)

    @property
    def is_same(self) -> bool:
        """Whether places are the numbers of states."""
        return self.states == list(range(1, self.count + 1))

    def place(self, state: int) -> int:
        """Return the place of a state."""
        if state == 0:
            return 0
        return self.base[self._plan.region_of[state]] + self._plan.number[state]

    def of(self, base: int, number: str) -> str:
        """Return the place of a number within the region that begins after a place."""
        return f"{base}u + {number}" if base else number
