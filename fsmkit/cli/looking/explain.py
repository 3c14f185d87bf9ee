"""``fsmkit explain``: print the meaning of a finding, and its fixes."""

from __future__ import annotations

import click
from rich.markdown import Markdown
from rich.text import Text

from fsmkit.cli.common.console import STYLES, print_json, result
from fsmkit.cli.common.verbs import verb
from fsmkit.diagnostics import Rule, rule, rules
from fsmkit.diagnostics.suggestions import suggest

EPILOG = """\b
Examples:
  fsmkit explain FK0351
  fsmkit explain nondeterministic-choice
  fsmkit explain                      (lists all)
"""


@verb(EPILOG)
@click.argument("code", required=False)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def command(code: str | None, as_json: bool) -> int:
    """Explain a finding by its code or name, or list all findings."""
    if code is None:
        if as_json:
            print_json([document(known) for known in rules()])
        else:
            for known in rules():
                result.print(heading(known))
        return 0
    known = find(code)
    if as_json:
        print_json({**document(known), "explanation": known.explanation})
    else:
        result.print(heading(known))
        result.print()
        result.print(Markdown(known.explanation))
    return 0


def find(code: str) -> Rule:
    """Return the rule of a code or name, however it is cased; a usage error where none is."""
    try:
        return rule(code.strip().upper()) if code[:2].upper() == "FK" else rule(code.lower())
    except LookupError:
        known = [name for r in rules() for name in (r.name, r.code)]
        advice = suggest(code.lower(), known) or suggest(code.upper(), known)
        advice = advice or "`fsmkit explain` lists all"
        raise click.BadParameter(
            f"there is no finding `{code}`; {advice}", param_hint="CODE"
        ) from None


def heading(known: Rule) -> Text:
    """Return the line of a rule in the list."""
    return Text.assemble(
        (known.code, "bold"), "  ", (f"{known.severity.value:8}", STYLES[known.severity]),
        known.name,
    )  # fmt: skip


def document(known: Rule) -> dict[str, object]:
    """Return a rule as data for JSON."""
    return {"code": known.code, "name": known.name, "severity": known.severity.value}
