"""Print styled text; `fsmkit.cli.common.console` imports this module at its first output."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

COLOR_SYSTEMS: Final[dict[str, Literal["auto", "256"] | None]] = {
    "auto": "auto",
    "always": "256",
    "never": None,
}


class Styled(Console):
    """A stream of styled text, for one command line."""

    def __init__(self, *, stderr: bool, width: int | None, color: str) -> None:
        """Open standard output or standard error; ``width`` overrides that of the terminal.

        ``color``: print in colours ``always``, ``never``, or on terminals (``auto``).
        """
        super().__init__(
            stderr=stderr,
            highlight=False,
            soft_wrap=width is None,
            width=width,
            no_color=True if color == "never" else None,
            color_system=COLOR_SYSTEMS[color],
        )
        self._is_styled = self.is_terminal or color == "always" or width is not None

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as `rich.console.Console.print` does, but plain text in a pipe as it is.

        A run of a large chart prints hundreds of thousands of lines; rich takes a millisecond for
        each.
        """
        is_plain = (
            not (self._is_styled or self.quiet)
            and len(objects) == 1
            and options.keys() <= {"markup", "style"}
        )
        text = objects[0] if is_plain else None
        if isinstance(text, Text):
            self.file.write(f"{without_controls(text.plain)}\n")
        elif isinstance(text, str) and options.get("markup") is False:
            self.file.write(f"{without_controls(text)}\n")
        else:
            super().print(*objects, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield the printed segments, without control sequences of the text."""
        for segment in super().render(renderable, options):
            yield (
                segment
                if segment.control
                else segment._replace(text=without_controls(segment.text))
            )


def without_controls(text: str) -> str:
    """Return a string without control characters of terminals."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text
    )
