"""Help: groups of verbs, headings of options, sentences that start with a verb."""

from __future__ import annotations

import re

import click
import pytest

from fsmkit.cli import Verbs, cli, execute
from fsmkit.cli.common.verbs import MOVED, Verb

MOST_WORDS = 15
MOST_LINES = {"": 65, "check": 70}
"""Lines of the longest helps, on a terminal of 100 columns; "" is that of `fsmkit` itself."""
CONTEXT = click.Context(cli)
VERBS = cli.list_commands(CONTEXT)


def verb_of(name: str) -> Verb:
    assert isinstance(cli, Verbs)
    found = cli.get_command(CONTEXT, name)
    assert isinstance(found, Verb)
    return found


OPTIONS = [
    (name, option)
    for name in VERBS
    for option in verb_of(name).params
    if isinstance(option, click.Option)
]


def test_the_list_of_verbs_cuts_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines[1:] if line.endswith("...")] == []


@pytest.mark.parametrize("name", VERBS)
def test_a_verb_says_what_it_does(name: str) -> None:
    command = verb_of(name)
    first = (command.help or "").splitlines()[0]
    assert first.endswith(".")
    assert re.match("[A-Z][a-z]+[ ,]", first), "it starts with a verb"
    assert re.search(rf"\bfsmkit {name}\b", command.epilog or ""), "an example"


@pytest.mark.parametrize(
    ("name", "option"), [pytest.param(n, o, id=f"{n} {o.opts[-1]}") for n, o in OPTIONS]
)
def test_an_option_is_described_by_its_effect(name: str, option: click.Option) -> None:
    text = option.help or ""
    assert re.fullmatch(r"[A-Z][a-z]+ .*\.", text), f"{name}: {text!r}"
    assert len(text.split()) <= MOST_WORDS
    assert "..." not in text
    assert not re.match(r"(The|A|An|What|Which|How|Whose|With|Of)\b", text)


@pytest.mark.parametrize("name", VERBS)
def test_headings_name_options_that_there_are(name: str) -> None:
    command = verb_of(name)
    own = {parameter.name for parameter in command.params}
    of_others = {"strict", "errors", "allowed", "is_fixing"}
    assert {n for n in command.heading_of if n not in own} <= of_others


@pytest.mark.parametrize("name", MOST_LINES)
def test_long_help_fits(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    assert execute([*name.split(), "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= MOST_LINES[name]
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize("old", MOVED)
def test_an_old_option_names_the_new_one(old: str, capsys: pytest.CaptureFixture[str]) -> None:
    verb, option = old.split()
    assert execute([verb, "x.yaml", option, "5"]) == 2
    assert f"Write `{MOVED[old]}` instead" in capsys.readouterr().err
