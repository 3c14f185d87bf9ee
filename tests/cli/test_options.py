"""Habits of the command line: short options, exit codes, what is probably meant, ``--strict``."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.shell_completion import get_completion_class

import fsmkit
from fsmkit.cli import Verbs, cli, execute
from tests.helps import lacking, named_options, options_of

PACKAGE = Path(fsmkit.__file__).parent

GATE = """\
chart: Gate
events: {in: [go]}
data: {unread: 0..9 = 0}
initial: a
states:
  a: {on: {go: {target: b, do: unread = 1}}}
  b: {on: {go: a}}
"""
LENIENT = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
    '<state id="a"><transition event="e" cond="nowhere.at.all()" target="a"/></state></scxml>'
)


@pytest.fixture
def gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "gate.yaml").write_text(GATE, encoding="utf-8")
    (tmp_path / "lenient.scxml").write_text(LENIENT, encoding="utf-8")
    (tmp_path / "system.yaml").write_text(
        "system: S\nmachines: {one: lenient.scxml}\n", encoding="utf-8"
    )
    monkeypatch.chdir(tmp_path)
    return "gate.yaml"


def verbs() -> list[str]:
    import click

    return cli.list_commands(click.Context(cli))


@pytest.mark.parametrize("verb", verbs())
def test_every_verb_has_the_short_options(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute([verb, "--help"]) == 0
    told = capsys.readouterr().out
    assert "-q, --quiet" in told
    assert "-v, --verbose" in told
    assert "--color" in told
    assert "--json" in told
    assert "\n  --out" not in told
    assert "\n  --target" not in told


@pytest.mark.parametrize(
    ("wrong", "meant"), [("chek", "check"), ("exprot", "export"), ("shw", "show")]
)
def test_a_wrong_verb_is_told_with_what_is_meant(
    wrong: str, meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute([wrong]) == 2
    told = capsys.readouterr().err
    assert f"there is no verb `{wrong}`" in told
    assert f"did you mean `{meant}`?" in told


UNKNOWN = [
    ("compile gate.yaml --target uml", "there is no target `uml`: c, "),
    ("compile gate.yaml -t pyhton", "did you mean `python`?"),
    ("compile gate.yaml --optimize speed", "there is no aim `speed`: size"),
    ("compile gate.yaml --without cue", "there is no part `cue`"),
    ("compile gate.yaml -t python --with cue", "there is no part `cue`"),
    ("run gate.yaml --events go -t cc", "there is no target `cc`: "),
    ("convert gate.yaml --to xml", "there is no notation `xml`: "),
    ("export gate.yaml --to uppal", "did you mean `uppaal`?"),
    ("export gate.yaml --to aut --property P", "has no property `P`"),
    ("export gate.yaml --to aut --time dense", "there is no kind of time `dense`: "),
    ("draw gate.yaml -o x.gif", "`.gif`"),
    ("draw gate.yaml --active aa", "has no state `aa`"),
    ("check gate.yaml --property P", "has no property `P`"),
    ("check gate.yaml --time zone", "did you mean `zones`?"),
    ("check gate.yaml --engine rust", "there is no engine `rust`: c, python"),
    ("check gate.yaml --storage less", "there is no storage `less`: "),
    ("check gate.yaml --no-reduction slep", "did you mean `sleep`?"),
    ("check gate.yaml --memory much", "`much`"),
    ("check gate.yaml --timeout long", "`long`"),
    ("check gate.yaml --draw x.gif", "`.gif`"),
    ("check gate.yaml --save-test x.rs", "`.rs`"),
    ("check gate.yaml --error unred-data", "rule `unred-data` does not exist; did you mean"),
    ("check gate.yaml --allow broken-yaml", "`broken-yaml` is an error, which stays one"),
    ("conformance . --target uml", "there is no target `uml`: all, "),
    ("paths hots", "did you mean `hosts`?"),
    ("explain FK9999", "there is no finding `FK9999`"),
    ("show gate.yaml --color bright", "there is no colouring `bright`: auto, always, never"),
]


@pytest.mark.usefixtures("gate")
@pytest.mark.parametrize(("line", "message"), UNKNOWN)
def test_an_unknown_value_is_wrong_usage(
    line: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(line.split()) == 2
    assert message in capsys.readouterr().err


READING = (
    "show {}",
    "check {}",
    "compile {} -o made",
    "draw {}",
    "run {} --events e",
    "convert {} --to yaml",
    "export {} --to aut",
)


@pytest.mark.cc
@pytest.mark.usefixtures("gate")
@pytest.mark.parametrize("line", READING)
def test_strict_is_for_every_verb_that_reads_charts(
    line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = line.format("lenient.scxml").split()
    execute(arguments)
    assert "error[FK0226]" not in capsys.readouterr().err
    assert execute([*arguments, "--strict"]) == 1
    assert "error[FK" in capsys.readouterr().err


@pytest.mark.cc
@pytest.mark.usefixtures("gate")
@pytest.mark.parametrize("verb", ["show", "check", "run"])
def test_strict_reaches_the_charts_of_a_system(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    events = ["--events", ""] if verb == "run" else []
    execute([verb, "system.yaml", *events])
    told = capsys.readouterr().err
    assert "warning[FK02" in told
    assert "error[FK02" not in told
    assert execute([verb, "system.yaml", *events, "--strict"]) == 1
    assert "error[FK" in capsys.readouterr().err


def test_rules_count_as_the_options_say(gate: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["show", gate]) == 0
    assert "note[FK0354] unread-data" in capsys.readouterr().err
    code = "FK0354"
    for name in (code, "unread-data"):
        assert execute(["show", gate, "--error", name]) == 1
        assert f"error[{code}]" in capsys.readouterr().err
        assert execute(["show", gate, "--allow", name]) == 0
        assert code not in capsys.readouterr().err


@pytest.mark.cc
def test_errors_of_exploring_count_too(gate: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(gate).write_text(
        GATE.replace("b: {on: {go: a}}", "b: {on: {go: {if: unread > 5, target: a}}}"),
        encoding="utf-8",
    )
    execute(["check", gate, "--json"])
    names = {f["rule"] for f in json.loads(capsys.readouterr().out)["findings"]}
    assert "never-taken" in names
    execute(["check", gate, "--json", "--error", "never-taken"])
    found = json.loads(capsys.readouterr().out)
    assert [f["severity"] for f in found["findings"] if f["rule"] == "never-taken"] == ["error"]
    assert found["verdict"] == "violated"


def test_quiet_leaves_out_remarks_and_warnings(
    gate: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["compile", gate, "-o", "made", "-q"]) == 0
    told = capsys.readouterr()
    assert told.out == told.err == ""
    assert Path("made/gate.c").is_file()
    assert execute(["show", gate, "-q"]) == 0
    told = capsys.readouterr()
    assert told.out.startswith("Gate")
    assert told.err == ""
    assert execute(["compile", gate, "-o", "made"]) == 0
    assert "made/gate.c" in capsys.readouterr().out


def test_verbose_explains_and_colours_can_be_forced(
    gate: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["show", gate, "-v", "--color", "always"]) == 0
    told = capsys.readouterr()
    assert "\x1b[" in told.out
    assert "## Instead" in told.err
    assert execute(["show", gate, "--color", "never"]) == 0
    assert "\x1b[" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (
            "fsmkit c",
            {
                "cache",
                "campaign",
                "certify",
                "check",
                "check-certificate",
                "compile",
                "conformance",
                "convert",
                "cover",
                "coverage",
            },
        ),
        ("fsmkit compile --target p", {"package", "python", "pyext"}),
        ("fsmkit check --ti", {"--time", "--timeout"}),
        ("fsmkit show --col", {"--color"}),
    ],
)
def test_shells_complete(
    words: str,
    offered: set[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("_FSMKIT_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    with pytest.raises(SystemExit):
        execute([])
    assert {line.split(",")[1] for line in capsys.readouterr().out.split()} == offered


SHELLS = {
    "zsh": ({"COMP_WORDS": "{line}", "COMP_CWORD": "{last}"}, "plain\n{value}\n"),
    "fish": ({"COMP_WORDS": "{line}", "COMP_CWORD": "{word}"}, "plain,{value}"),
}
"""What a shell sets while it completes, and what it reads; bash is above."""


@pytest.mark.parametrize("shell", SHELLS)
@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("fsmkit comp", "compile"),
        ("fsmkit check --time", "--timeout"),
        ("fsmkit compile gate.yaml --target py", "python"),
        ("fsmkit new gate.yaml --like par", "parallel"),
        ("fsmkit schema dep", "deployment"),
    ],
)
def test_shells_complete_verbs_options_and_values(
    shell: str,
    line: str,
    value: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = line.split()
    settings, told = SHELLS[shell]
    for name, text in settings.items():
        given = text.format(line=line, last=len(words) - 1, word=words[-1])
        monkeypatch.setenv(name, given)
    found = get_completion_class(shell)
    assert found is not None
    complete = found(cli, {}, "fsmkit", "_FSMKIT_COMPLETE")
    assert told.format(value=value) in complete.complete()
    assert f"_FSMKIT_COMPLETE={shell}_complete" in complete.source()
    assert not capsys.readouterr().err


def test_a_help_that_the_verb_cannot_follow_is_found() -> None:
    assert lacking("choose another place with `--out`", "new") == ["--out"]
    assert lacking("choose another place with `--out`", "draw") == []
    assert lacking("leave --target out; `fsmkit check --time zones` has it", "new") == ["--target"]
    assert lacking("`fsmkit check --prefix a_chart`", "compile") == ["--prefix"]
    assert lacking("use `--exec '/opt/board --realtime'` or `pytest --cov`", "deploy") == []


def test_the_texts_of_fsmkit_name_options_that_there_are() -> None:
    """A text of the module of a verb, or with the name of one, names options of that verb."""
    assert isinstance(cli, Verbs)
    verbs = {verb: options_of(verb) for verb in cli.list_commands(click.Context(cli))}
    known = frozenset[str]().union(*verbs.values()) | {"--version"}
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        of_verb = verbs.get(path.stem, known) if path.parent.parent == PACKAGE / "cli" else known
        for text in help_texts(path):
            for verb, option in named_options(text):
                if option not in (verbs.get(verb, known) if verb else of_verb):
                    wrong.append(f"{path.relative_to(PACKAGE)}: {option} in {text!r}")
    assert wrong == []


def help_texts(path: Path) -> Iterator[str]:
    """Yield the texts that are given as ``help`` in a module; a computed part is ``{}``."""
    source = path.read_text(encoding="utf-8")
    if "help=" not in source:
        return  # as most: to parse them is all the effort
    for node in ast.walk(ast.parse(source)):
        for keyword in node.keywords if isinstance(node, ast.Call) else ():
            if keyword.arg == "help":
                value = keyword.value
                parts = value.values if isinstance(value, ast.JoinedStr) else [value]
                yield "".join(str(p.value) if isinstance(p, ast.Constant) else "{}" for p in parts)
