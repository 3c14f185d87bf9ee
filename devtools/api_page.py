"""Write the page of the public API from docstrings: ``python -m devtools.api_page``."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import fsmkit

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "api.md"
SECTION = re.compile(r"(Args|Returns|Raises):")
ENTRY = re.compile(r"( *)(\*{0,2}\w+): (.*)")
QUOTED = re.compile(r": (['\"])(.*?)\1(?= =|$)")
"""An unevaluated annotation in the output of `inspect`."""
ORDER = (
    "read", "read_chart", "read_system", "compile", "check", "export", "draw", "machine",
)  # fmt: skip


def page() -> str:
    """Return the page: the module's docstring, a section a function, the classes in a table."""
    lines = ["# The Python API", "", *markdown(fsmkit.__doc__ or "")]
    for name in ORDER:
        lines += ["", *function(getattr(fsmkit, name))]
    lines += ["", "## Classes", "", "| name | is |", "|---|---|"]
    for name in fsmkit.__all__:
        found = getattr(fsmkit, name)
        if isinstance(found, type):
            lines.append(f"| `{name}` | {summary(found)} |")
    return "\n".join(lines) + "\n"


def summary(found: type) -> str:
    """Return the first paragraph of a docstring, on one line."""
    first = inspect.cleandoc(found.__doc__ or "").split("\n\n")[0]
    return marked(" ".join(first.split())).replace("|", "\\|")


def function(found: FunctionType) -> Iterator[str]:
    """Yield a section: the signature, the text, and tables of arguments and errors."""
    signature = inspect.signature(found)
    yield f"## `fsmkit.{found.__name__}`"
    yield ""
    yield "```python"
    yield f"{found.__name__}("
    is_by_name = False
    for parameter in signature.parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not is_by_name:
            is_by_name = True
            yield "    *,"
        shown = QUOTED.sub(r": \2", str(parameter))
        yield f"    {shown},"
    yield f") -> {signature.return_annotation}"
    yield "```"
    yield ""
    yield from markdown(inspect.cleandoc(found.__doc__ or ""))


def markdown(text: str) -> Iterator[str]:
    """Yield a docstring as Markdown: sections of Google's style become lists."""
    is_code = False
    within = ""
    for line in text.rstrip().split("\n"):
        section = SECTION.fullmatch(line)
        entry = ENTRY.fullmatch(line)
        if section:
            within = section[1]
            yield f"**{within}**"
            yield ""
        elif not within and line.startswith("    "):
            yield from (() if is_code else ("```python",))
            is_code = True
            yield line[4:]
        else:
            if is_code:
                yield "```"
                is_code = False
            if within and entry and len(entry[1]) == 4 and within != "Returns":
                yield f"* `{entry[2]}`: {marked(entry[3])}"
            elif within and line:
                yield f"  {marked(line.strip())}" if within != "Returns" else marked(line.strip())
            else:
                yield marked(line.removesuffix("::") + ":" * line.endswith("::"))


def marked(text: str) -> str:
    """Return a text with single backquotes."""
    return text.replace("``", "`")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
