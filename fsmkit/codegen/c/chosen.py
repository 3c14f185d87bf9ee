"""Names in C that a binding chooses, in place of names derived from the chart's."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.codegen.existing_c.model import Binding, Exports
from fsmkit.emit import plain, snake


@dataclass(frozen=True, slots=True)
class Chosen:
    """The names that a binding chooses. Without a binding every name is derived from the chart."""

    binding: Binding | None = None

    @property
    def exports_constants(self) -> bool:
        """Whether the header exports constants of the chart."""
        return self.binding is None or self.binding.exports is not Exports.NONE

    def whole(self, kind: str, name: str) -> str | None:
        """Return the whole identifier that the binding chooses, or None if it is derived."""
        return None if self.binding is None else self.binding.chosen(kind, plain(name))

    def word(self, kind: str, name: str) -> str:
        """Return the word that identifiers contain: by default the name in the chart."""
        return self.whole(kind, name) or name

    def behind(self, prefix: str, kind: str, name: str) -> str:
        """Return the part of an identifier that follows the prefix of the machine."""
        found = self.whole(kind, name)
        return snake(name) if found is None else found.removeprefix(f"{prefix}_")

    def is_chosen(self, kind: str, name: str) -> bool:
        """Whether the binding chose this name, which a header declares."""
        if self.binding is None:
            return False
        name = plain(name)
        if kind == "member":
            return any(k == kind and n.endswith(f".{name}") for k, n in self.binding.names)
        kinds = {"record": ("type",), "variable": ("data", "input", "output")}.get(kind, (kind,))
        return any((each, name) in self.binding.names for each in kinds)


MADE = Chosen()
"""No choice: every name is derived from the chart's."""
