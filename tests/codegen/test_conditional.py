"""Conditions on facts in runtime text: lines that a machine does not need are dropped."""

from __future__ import annotations

import ast
import re
from functools import cache
from itertools import product

import pytest

from devtools.plain import plain_case
from fsmkit.codegen.conditional import selected
from fsmkit.codegen.python.template import machine
from fsmkit.codegen.python.trimming import facts_of, needed_lines
from fsmkit.plan.features import features_of
from fsmkit.runtime.library import PYTHON_LIBRARY

NESTED = """\
before
#if A
first
#if B && !C
both
#elif C || B
either
#else
neither
#endif
#elif B
second
#else
third
#endif
#ifdef HOST
#if C
inner
#else
other
#endif
#endif
after"""
IN_PYTHON = NESTED.replace("#if ", "    # if ").replace("#elif", "    # elif")
IN_PYTHON = IN_PYTHON.replace("#else", "    # else").replace("#endif", "    # endif")


def expected(a: bool, b: bool, c: bool) -> list[str]:
    inner = "both" if b and not c else "either" if c or b else "neither"
    outer = ["first", inner] if a else ["second"] if b else ["third"]
    return ["before", *outer, "#ifdef HOST", "inner" if c else "other", "#endif", "after"]


@pytest.mark.parametrize("text", [NESTED, IN_PYTHON])
def test_all_combinations_of_nested_conditions(text: str) -> None:
    for a, b, c in product((False, True), repeat=3):
        found = [line.strip() for line in selected(text.split("\n"), {"A": a, "B": b, "C": c})]
        assert [line.replace("# endif", "#endif") for line in found] == expected(a, b, c)


def test_a_fact_that_nobody_decides_is_an_error() -> None:
    with pytest.raises(KeyError, match="RENAMED"):
        list(selected(["# if RENAMED", "# endif"], {"KNOWN": True}))


@pytest.mark.parametrize("line", ["# if it is late", "x = 1  # if A", "# else no", "#ifndef A"])
def test_other_comments_stay(line: str) -> None:
    assert list(selected([line], {})) == [line]


@cache
def facts() -> dict[str, bool]:
    """Return the facts of the Python runtime, for the machine of some chart."""
    features = features_of(plain_case(0, 0).chart)
    return dict(facts_of(features, None, traced=True, recorded=True, covered=True, saved=True))


def test_the_runtime_uses_each_fact_and_no_other() -> None:
    texts = [path.read_text(encoding="utf-8") for path in sorted(PYTHON_LIBRARY.glob("*.py"))]
    used = {
        word
        for text in texts
        for condition in re.findall(r"# (?:el)?if ([A-Z_!&| ]+)$", text, re.MULTILINE)
        for word in re.findall(r"[A-Z_]+", condition)
    }
    assert used | {"TRACED"} == facts().keys()  # which is a line of the runtime, not a comment


@pytest.mark.parametrize("name", sorted(facts()))
@pytest.mark.parametrize("others", [False, True])
def test_the_runtime_is_sound_with_and_without_each_fact(name: str, *, others: bool) -> None:
    word = "trace is not None" if name == "TRACED" else name
    methods = [m for m in machine(saved=True, recorded=True).methods if word in m.text]
    texts = {}
    for value in (False, True):
        known = {**dict.fromkeys(facts(), others), name: value}
        texts[value] = "\n".join("\n".join(needed_lines(m.text, known)) for m in methods)
        ast.parse(texts[value])
        assert not re.search(r"# (if|elif|else|endif)\b", texts[value])
    is_nested = name == "ALTERNATIVES"  # within TIMED_GUARDS
    assert texts[False] != texts[True] or (is_nested and not others)


def test_only_a_machine_with_a_trace_that_is_not_recorded_tests_for_one() -> None:
    for traced, recorded in product((False, True), repeat=2):
        known = {**dict.fromkeys(facts(), True), "TRACED": traced, "RECORDED": recorded}
        methods = machine(saved=True, recorded=True).methods
        text = "\n".join("\n".join(needed_lines(m.text, known)) for m in methods)
        assert ("trace is not None" in text) is (traced and not recorded)
        assert ("self._tell(" in text) is traced
