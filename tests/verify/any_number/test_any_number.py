"""Proofs for every number of machines, compared with explicit searches."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from devtools.any_number import problems
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError, Source, Span, Text
from fsmkit.system.indices import integer
from fsmkit.verify.any_number import prove
from fsmkit.verify.any_number.terms import Ends, NotUniformError, Term, term_of
from fsmkit.verify.any_number.windows import Windows
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.resources.time import Time

SYSTEMS = Path(__file__).parent / "systems"
RING = (SYSTEMS / "token_ring.yaml").read_text(encoding="utf-8")
PASSAGE = (SYSTEMS / "passage.yaml").read_text(encoding="utf-8")


def proof_of(path: Path, time: Time = "untimed", name: str = "") -> prove.Proof:
    return prove.prove_file(
        path,
        Findings(),
        parameters={"N": "any"},
        options=ExplorationOptions(engine="python", time=time),
        properties=frozenset({name} - {""}),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "time"),
    [
        ("token_ring", "untimed"),
        ("belt", "untimed"),
        ("passage", "untimed"),
        ("lamps", "discrete"),
        ("mutex", "untimed"),
        ("room", "untimed"),
        ("fischer", "discrete"),
    ],
)
def test_all_properties_hold_for_every_number(name: str, time: Time) -> None:
    options = ExplorationOptions(engine="python", time=time)
    proof = proof_of(SYSTEMS / f"{name}.yaml", time=time)
    most = 4 if name == "fischer" else 6
    assert list(problems(proof, most, options, states=300)) == []
    assert {result.verdict for result in proof.results} == {Verdict.HOLDS}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "property_", "value"),
    [
        ("one_sided", "lock", 2),
        ("full_belt", "D", 2),
        ("forged_3", "one", 3),
        ("forged_5", "one", 5),
        ("forged_7", "one", 7),
    ],
)
def test_the_smallest_counterexample_is_found(name: str, property_: str, value: int) -> None:
    proof = proof_of(SYSTEMS / f"{name}.yaml", name=property_)
    result = next(one for one in proof.results if one.name == property_)
    assert result.verdict is Verdict.VIOLATED
    assert result.reason == f"for N={value}"
    assert result.trace is not None
    assert "interpreter" in result.trace.replayed


@pytest.mark.slow
@pytest.mark.parametrize("places", [3, 5, 7])
def test_a_room_with_too_many_places_is_refuted(places: int) -> None:
    given = {"N": "any", "PLACES": str(places), "MOST": str(places - 1)}
    options = ExplorationOptions(engine="python", time="untimed")
    names = frozenset({"full"})
    proof = prove.prove_file(
        SYSTEMS / "room.yaml", Findings(), parameters=given, options=options, properties=names
    )
    assert [result.reason for result in proof.results] == [f"for N={places}"]
    assert proof.verdict is Verdict.VIOLATED


@pytest.mark.slow
def test_a_process_that_is_too_hasty_is_refuted() -> None:
    proof = proof_of(SYSTEMS / "hasty.yaml", "discrete", "exclusion")
    assert [result.reason for result in proof.results] == ["for N=2"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("turn == ME", "turn <= ME"),
        ("turn == ME", "turn == ME + 1"),
        ("turn == ME", "turn + 1 == ME"),
        ("turn == ME", "turn == N"),
        ("turn == ME", "turn == 2"),
        ("turn == ME", "ME > 1 and turn == ME"),
        ("do: turn = ME", "do: turn = ME - 1"),
        ("do: turn = ME", "do: turn += ME"),
        ("do: turn = 0", "do: turn = 1"),
        ("turn: 0..N = 0", "turn: 0..N = 1"),
        ("WAIT: 3ms", "WAIT: 3ms * ME"),
        ("initial: idle", "entry: turn = ME\ninitial: idle"),
    ],
)
def test_processes_that_know_an_order_are_rejected(old: str, new: str, tmp_path: Path) -> None:
    chart = (SYSTEMS / "process.yaml").read_text(encoding="utf-8")
    assert old in chart
    (tmp_path / "process.yaml").write_text(chart.replace(old, new), encoding="utf-8")
    (tmp_path / "fischer.yaml").write_bytes((SYSTEMS / "fischer.yaml").read_bytes())
    with pytest.raises(FsmkitError):
        proof_of(tmp_path / "fischer.yaml", "discrete")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("turn: 0..N = 0", "turn: 0..N - 1 = 0"),
        ("turn: 0..N = 0", "turn: 0..N = 1"),
        ("ME: i", "ME: i + 1"),
        ("i in 1..N", "i in 0..N - 1"),
        ("p[i].In(critical)", "p[i].In(critical) and turn == 1"),
        ("p[i].In(critical)", "p[i].In(critical) and p[i].turn == i"),
        ("count(i in p:", "count(i in 2..N:"),
    ],
)
def test_systems_that_know_an_order_are_not_proved(
    old: str, new: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prove, "MOST_WIDTH", 2)
    monkeypatch.setattr(prove, "EXPLORED", 3)
    text = (SYSTEMS / "fischer.yaml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "fischer.yaml").write_text(text.replace(old, new), encoding="utf-8")
    (tmp_path / "process.yaml").write_bytes((SYSTEMS / "process.yaml").read_bytes())
    try:
        proof = proof_of(tmp_path / "fischer.yaml", "discrete")
    except FsmkitError:
        return
    assert proof.verdict is Verdict.UNDECIDED


@pytest.mark.slow
def test_one_missing_window_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison of windows fails if a step is forgotten."""
    own = Windows._steps_beside

    def forgetful(self: Windows, places: tuple[int, ...], *rest: object) -> None:
        if 0 in places:
            own(self, places, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(Windows, "_steps_beside", forgetful)
    options = ExplorationOptions(engine="python", time="untimed")
    proof = proof_of(SYSTEMS / "token_ring.yaml")
    assert list(problems(proof, 6, options, states=300))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (RING.replace("FIRST: i == 0", "FIRST: i % 2 == 0"), "a remainder is only taken by"),
        (RING.replace("FIRST: i == 0", "FIRST: N % 2 == 0"), "a remainder is only taken by"),
        (RING.replace("FIRST: i == 0", "FIRST: i == 7"), "more than 3 machines at an end"),
        (RING.replace("FIRST: i == 0", "FIRST: 2 * i == N"), "depends on the number of machines"),
        (RING.replace("(i + 1) % N].token", "(i * 2) % N].token"), "number of machines"),
        (RING.replace("[(i + 1) % N].token", "[0].token"), "positions apart"),
        (RING.replace("0..N - 1", "0..7"), "no array of machines has a range up to `N`"),
        (RING.replace("{N: 3}", "{N: 3, M: N}"), "the parameter `M` depends on it"),
        (RING.replace("connect:", "schedule: {cyclic: [x], period: 1s}\nconnect:"), "cyclic"),
        (RING.replace('will: ["node[i]"]', 'will: ["node[N - 5]"]'), "more than 3 machines"),
        (PASSAGE.replace("RIGHT: i + 1", "RIGHT: N + 1"), "positions apart"),
        (PASSAGE.replace("RIGHT: i + 1", "RIGHT: N - i"), "faster than the number"),
        (PASSAGE.replace("N + 2", "2 * N"), "has another length"),
        (PASSAGE.replace("shared:", "  other: hub.yaml\nshared:"), "neither in an array"),
    ],
)
def test_systems_that_are_not_uniform_are_rejected(
    wrong: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "system.yaml").write_text(wrong, encoding="utf-8")
    for name in ("plain_node.yaml", "door.yaml"):
        (tmp_path / name).write_bytes((SYSTEMS / name).read_bytes())
    (tmp_path / "hub.yaml").write_text("chart: Hub\ninitial: a\nstates: {a: {rest: true}}\n")
    with pytest.raises(FsmkitError, match="not-uniform") as caught:
        proof_of(tmp_path / "system.yaml")
    assert message in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    "guard",
    ["N > 5", "OWN > 3", "len(open) > 5", "open[N - OWN]", "open == open", "OWN % 2 == 0"],
)
def test_charts_that_count_are_rejected(guard: str, tmp_path: Path) -> None:
    door = (SYSTEMS / "door.yaml").read_text(encoding="utf-8")
    wrong = door.replace('"not open[LEFT] and', f'"not ({guard}) and not open[LEFT] and')
    (tmp_path / "door.yaml").write_text(wrong, encoding="utf-8")
    (tmp_path / "passage.yaml").write_text(PASSAGE, encoding="utf-8")
    with pytest.raises(FsmkitError, match="not-uniform"):
        proof_of(tmp_path / "passage.yaml")


@pytest.mark.slow
@pytest.mark.parametrize(
    "property_",
    [
        "invariant: 'not (node[0].In(critical) and node[1].In(critical))'",
        "invariant: 'all(i in node: not node[i].In(critical) or i < 7)'",
        "invariant: 'all(i in 0..7: not node[i].In(critical))'",
        "invariant: 'all(i in node: not node[(i + N / 2) % N].In(critical))'",
        "invariant: 'count(i in node: node[i].In(waiting)) >= N - 1'",
        "reachable: 'node[0].In(critical)'",
    ],
)
def test_other_properties_are_undecided(property_: str, tmp_path: Path) -> None:
    head = RING.partition("properties:")[0]
    (tmp_path / "plain_node.yaml").write_bytes((SYSTEMS / "plain_node.yaml").read_bytes())
    text = f"{head}properties:\n  p: {{{property_}}}\n"
    (tmp_path / "ring.yaml").write_text(text, encoding="utf-8")
    try:
        proof = proof_of(tmp_path / "ring.yaml")
    except FsmkitError:
        return  # the file is wrong for some N
    result = next(one for one in proof.results if one.name == "p")
    assert result.verdict is not Verdict.HOLDS


@pytest.mark.slow
def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    file = str(SYSTEMS / "token_ring.yaml")
    assert execute(["check", file, "--set", "N=3..any", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["least"] == 3
    assert {one["verdict"] for one in document["properties"]} == {"holds"}


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["plain_node.yaml", "--set", "FIRST=any"], 1, "is not a system"),
        (["token_ring.yaml", "--set", "N=any", "--set", "M=any"], 1, "cannot both be `any`"),
        (["token_ring.yaml", "--set", "M=any"], 1, "has no parameter `M`"),
        (["token_ring.yaml", "belt.yaml", "--set", "N=any"], 2, "one system"),
        (["token_ring.yaml", "--set", "N=1000000"], 1, "bad-index"),
        (["token_ring.yaml", "--set", "N=1000000..any"], 1, "starts from a value above"),
    ],
)
def test_wrong_values(
    arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(SYSTEMS / a) if a.endswith(".yaml") else a for a in arguments]
    assert execute(["check", *files]) == code
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    "text",
    [
        "i", "N", "(i + 1) % N", "(i + N - 1) % N", "min(i, (i + 1) % N)", "max(i, (i + 1) % N)",
        "i == 0 ? 1 : 0", "i == N - 1 ? 5 : i", "i > 2 ? 1 : 0", "i < N - 2 ? i + 1 : 0",
        "i >= 1 ? 1 : 2", "i <= 1 and not (i == 0) ? 7 : i", "(i + 2 * N - 3) % N", "-(i - N)",
        "N > 4 ? i : 0", "i + 3 > N ? N - i : 9", "3 * i - 2 * i", "(i + 3) % (N + 1)",
    ],
)  # fmt: skip
def test_terms_have_the_value_of_each_machine(text: str) -> None:
    ends, source = Ends(), Source("term", text)
    whole = Text(text, Span(source, 0, len(text)))
    while True:
        before = (ends.low, ends.high, ends.length)
        places = [
            *(Term(constant=n) for n in range(ends.low)),
            Term(position=1),
            *(Term(length=1, constant=-1 - n) for n in range(ends.high)),
        ]
        names = Term(length=1)
        values = {p: term_of(whole, {"N": names, "i": p}, ends) for p in places}
        if before == (ends.low, ends.high, ends.length):
            break
    for length in range(max(ends.length, ends.low + ends.high + 1), 13):
        for position in range(length):
            place = Term(position=1)
            if position < ends.low:
                place = Term(constant=position)
            elif position >= length - ends.high:
                place = Term(length=1, constant=position - length)
            value = values[place]
            assert isinstance(value, Term)
            found = Findings()
            expected = integer(whole, found, {"N": length, "i": position})
            assert value.at(position, length) == expected, (length, position)


@pytest.mark.parametrize("text", ["i % 2", "i * i", "i * N", "2 * i == N ? 1 : 0", "i / 2", "x"])
def test_terms_without_a_common_value_are_rejected(text: str) -> None:
    whole = Text(text, Span(Source("term", text), 0, len(text)))
    with pytest.raises(NotUniformError):
        term_of(whole, {"N": Term(length=1), "i": Term(position=1)}, Ends())
