"""What is kept of compiled explorers is executed, so it must be the user's own and whole."""

from __future__ import annotations

import json
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.verify.engines.c import cache as caches
from fsmkit.verify.engines.c import orders
from fsmkit.verify.engines.c.build import Builder
from fsmkit.verify.engines.c.cache import Cache, UnusableError, cache_folder, is_whole
from fsmkit.verify.engines.c.engine import compiler
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.resources.children import run
from fsmkit.verify.resources.deadline import Deadline
from tests.verify.conftest import Load
from tests.verify.systems import SYSTEMS

NAME = "0123456789abcdef" * 2
OTHER = "fedcba9876543210" * 2
pytestmark = pytest.mark.usefixtures("quickly_compiled")
needs_c = pytest.mark.cc


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache_folder()


@pytest.fixture
def with_core(folder: Path, cache_of_session: Path) -> None:
    """Put the core of the explorer into the folder, if other tests have compiled it."""
    folder.mkdir(mode=0o700, parents=True)
    for core in (cache_of_session / "fsmkit" / "explorer").glob("core-*"):
        shutil.copytree(core, folder / core.name)


@pytest.fixture
def hold() -> Iterator[ExitStack]:
    with ExitStack() as held:
        yield held


@pytest.fixture
def made(tmp_path: Path) -> Path:
    path = tmp_path / "made"
    path.write_bytes(b"program" * 1000)
    return path


def test_keeps_a_copy_that_is_found_again(folder: Path, made: Path, hold: ExitStack) -> None:
    cache = Cache(folder)
    assert cache.find(NAME, hold) is None
    kept = cache.add(NAME, {"explore": made}, hold)
    assert cache.find(NAME, hold) == kept
    assert (kept / "explore").read_bytes() == made.read_bytes()
    assert os.access(kept / "explore", os.X_OK)
    assert {path.name for path in folder.iterdir()} == {NAME}


def endless(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def piped(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


SPOILT: dict[str, Callable[[Path], object]] = {
    "a link to an endless device": endless,
    "a pipe": piped,
    "deep nesting": lambda path: path.write_text("[" * 100_000),
    "an endless number": lambda path: path.write_text("9" * 10_000),
    "bytes": lambda path: path.write_bytes(b"\xff\x00"),
    "a list": lambda path: path.write_text('["explore"]'),
    "numbers": lambda path: path.write_text('{"explore": 1}'),
    "too long": lambda path: path.write_text(" " * (caches.MOST_SUMS + 1)),
}
"""What a file may be instead of what a build wrote."""


@pytest.mark.parametrize("file", ["explore", caches.SUMS, caches.ORDER])
@pytest.mark.parametrize("damage", SPOILT)
def test_whatever_a_file_has_become_the_entry_is_built_again(
    folder: Path, made: Path, hold: ExitStack, file: str, damage: str
) -> None:
    cache = Cache(folder)
    with ExitStack() as first:
        kept = cache.add(NAME, {"explore": made}, first)
    (kept / caches.ORDER).write_text("{}")
    SPOILT[damage](kept / file)
    if file == caches.ORDER and (kept / file).is_file() and not (kept / file).is_symlink():
        assert orders._read(kept / "explore", 2) == ((), 0)
        return
    assert cache.find(NAME, hold) is None
    assert (cache.add(NAME, {"explore": made}, hold) / "explore").read_bytes() == made.read_bytes()


@pytest.mark.parametrize(
    "damage", ["empty", "cut", "changed", "gone", "more", "no sums", "bad sums", "no permission"]
)
def test_what_is_not_whole_is_made_again(
    folder: Path, made: Path, hold: ExitStack, damage: str
) -> None:
    cache = Cache(folder)
    with ExitStack() as first:
        program = cache.add(NAME, {"explore": made}, first) / "explore"
    whole = program.read_bytes()
    match damage:
        case "empty":
            program.write_bytes(b"")
        case "cut":
            program.write_bytes(whole[:100])
        case "changed":
            program.write_bytes(b"P" + whole[1:])
        case "gone":
            program.unlink()
        case "more":
            (program.parent / "else").write_bytes(b"")
        case "no sums":
            (program.parent / caches.SUMS).unlink()
        case "no permission":
            program.chmod(0o600)
        case "bad sums":
            (program.parent / caches.SUMS).write_text('["explore"]')
    assert cache.find(NAME, hold) is None
    again = cache.add(NAME, {"explore": made}, hold)
    assert (again / "explore").read_bytes() == whole
    assert {path.name for path in folder.iterdir()} == {NAME}


@pytest.mark.parametrize("what", ["explore", caches.SUMS, "."])
def test_what_others_could_have_written_does_not_count(
    folder: Path, made: Path, hold: ExitStack, what: str
) -> None:
    with ExitStack() as first:
        kept = Cache(folder).add(NAME, {"explore": made}, first)
    (kept / what).chmod(0o777)
    assert Cache(folder).find(NAME, hold) is None


def test_what_belongs_to_another_does_not_count(
    folder: Path, made: Path, hold: ExitStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Cache(folder).add(NAME, {"explore": made}, hold)
    assert is_whole(kept)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert not is_whole(kept)
    with pytest.raises(UnusableError, match="another user"):
        Cache(folder)


def test_a_folder_that_others_can_write_is_not_used(folder: Path) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    with pytest.raises(UnusableError, match="others can write it"):
        Cache(folder)
    folder.chmod(0o700)
    folder.parent.chmod(0o777)
    with pytest.raises(UnusableError, match="others can write `"):
        Cache(folder)
    folder.parent.chmod(0o1777)  # as /tmp: nobody can put another in its place
    Cache(folder)


def test_a_link_is_not_used(folder: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    folder.parent.mkdir(parents=True)
    folder.symlink_to(elsewhere)
    with pytest.raises(UnusableError, match="link"):
        Cache(folder)


def test_the_oldest_go_beyond_the_limit(folder: Path, made: Path) -> None:
    cache = Cache(folder)
    names = [f"{n:032x}" for n in range(5)]
    for n, name in enumerate(names):
        with ExitStack() as hold:
            os.utime(cache.add(name, {"explore": made}, hold), (1e9 + n, 1e9 + n))
    with ExitStack() as hold:
        assert cache.find(names[0], hold) is not None  # used now, so the youngest
    size = cache.entries()[0].size
    gone = cache.prune(3 * size)
    assert [entry.name for entry in gone] == names[1:3]
    assert {entry.name for entry in cache.entries()} == {names[0], *names[3:]}


def test_what_is_in_use_stays(folder: Path, made: Path, hold: ExitStack) -> None:
    cache = Cache(folder)
    kept = cache.add(NAME, {"explore": made}, hold)
    assert cache.prune(0) == ()
    assert is_whole(kept)
    hold.close()
    assert [entry.name for entry in cache.prune(0)] == [NAME]
    assert list(folder.iterdir()) == []


def test_what_an_interrupted_build_left_goes(folder: Path, made: Path, hold: ExitStack) -> None:
    cache = Cache(folder)
    for name in (".new-abc", "core-xyz12345"):
        (folder / name).mkdir()
        (folder / name / "part").write_bytes(b"")
        os.utime(folder / name, (1e9, 1e9))
    (folder / OTHER).write_bytes(b"a program of an earlier version")
    fresh = folder / ".new-now"
    fresh.mkdir()
    cache.add(NAME, {"explore": made}, hold)
    assert {path.name for path in folder.iterdir()} == {NAME, fresh.name}


def test_a_full_disk_leaves_nothing(
    folder: Path, made: Path, hold: ExitStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(source: Path, to: Path) -> None:
        Path(to).write_bytes(Path(source).read_bytes()[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shutil, "copyfile", full)
    with pytest.raises(OSError, match="No space"):
        Cache(folder).add(NAME, {"explore": made}, hold)
    assert list(folder.iterdir()) == []


# --- in a check -----------------------------------------------------------------------------------


def rules_of(load: Load) -> list[str]:
    findings = Findings()
    check(load(**SYSTEMS["drive"]), findings, options=ExplorationOptions("c", time="discrete"))
    return [d.rule.name for d in findings]


@pytest.mark.slow
@pytest.mark.cc
@needs_c
@pytest.mark.usefixtures("with_core")
def test_a_check_does_not_execute_what_another_put_there(
    load: Load, folder: Path, tmp_path: Path
) -> None:
    """The finding: a program of another user under the name of ours was executed."""
    assert "cache-not-used" not in rules_of(load)
    programs = [path / "explore" for path in folder.iterdir() if (path / "explore").exists()]
    (program,) = programs
    owned = tmp_path / "owned"
    program.write_text(f"#!/bin/sh\ntouch {owned}\n")
    rules_of(load)
    assert not owned.exists()
    assert is_whole(program.parent)  # it was made again
    program.write_text(f"#!/bin/sh\ntouch {owned}\n")
    folder.chmod(0o777)
    assert "cache-not-used" in rules_of(load)
    assert not owned.exists()


@pytest.mark.cc
@needs_c
@pytest.mark.usefixtures("with_core")
def test_a_check_goes_on_where_nothing_can_be_kept(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Cache, *arguments: object) -> Path:
        del self, arguments
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Cache, "add", full)
    findings = Findings()
    report = check(
        load(**SYSTEMS["drive"]), findings, options=ExplorationOptions("c", time="discrete")
    )
    assert report.exploration.states == 229
    (told,) = [d.message for d in findings if d.rule.name == "cache-not-used"]
    assert told.endswith("no space left on device")


@pytest.mark.slow
@pytest.mark.cc
@needs_c
@pytest.mark.usefixtures("with_core")
def test_two_at_once_make_one(load: Load, folder: Path) -> None:
    system = load(**SYSTEMS["drive"])
    found: list[int] = []

    def one() -> None:
        report = check(system, Findings(), options=ExplorationOptions("c", time="discrete"))
        found.append(report.exploration.states)

    both = [threading.Thread(target=one) for _ in range(2)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert found == [229, 229]
    assert all(is_whole(path) for path in folder.iterdir())


# --- the verb -------------------------------------------------------------------------------------


@pytest.mark.cc
def test_a_folder_of_parts_that_is_emptied_is_filled_again(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others clean temporary folders, also between compiling and linking."""
    del folder
    parts = tmp_path / "gone" / "parts"
    emptied: list[int] = []
    compiles = Builder._compile

    def compile_(self: Builder, shares: Any, place: Path, made: Any) -> None:
        if shares and "-c" not in shares[0][0] and len(emptied) < 1:
            emptied.append(len(list(parts.iterdir())))
            shutil.rmtree(parts.parent)
        compiles(self, shares, place, made)

    monkeypatch.setattr(Builder, "_compile", compile_)
    core = {"one.c": "int one(void) { return 1; }"}
    files = {"explore_a.c": "int one(void); int main(void) { return one() - 1; }"}
    command = (compiler() or "cc", "-O0")
    with closing(Builder(command, Deadline(), Findings(), parts)) as builder:
        for _ in range(2):
            assert run([str(builder.program(core, files))]).code == 0
    assert emptied == [1]
    assert [path.suffix for path in parts.iterdir()] == [".o"]


def test_the_verb_shows_and_empties(
    folder: Path, made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with ExitStack() as hold:
        Cache(folder).add(NAME, {"explore": made}, hold)
    assert execute(["cache", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in told["entries"]] == [NAME]
    assert told["folder"] == str(folder)
    assert told["bytes"] > 7000
    (folder / NAME / "explore").write_bytes(b"")
    assert execute(["cache", "--prune"]) == 0
    assert "removed 1" in capsys.readouterr().out
    assert execute(["cache", "--clear"]) == 0
    assert "removed 0" in capsys.readouterr().out
    assert list(folder.iterdir()) == []
    assert execute(["cache", "--prune", "--clear"]) == 2


def test_the_verb_says_why_it_is_not_used(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert execute(["cache"]) == 1
    assert "others can write it" in capsys.readouterr().err


def test_the_verb_lists_the_programs_used_last(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in range(25):
        path = folder / f"{number:032x}"
        path.mkdir(parents=True)
        os.utime(path, (1e9 + number, 1e9 + number))
    assert execute(["cache"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[-1] for line in lines[1:-1]] == [f"{n:032x}" for n in range(24, 4, -1)]
    assert lines[-1].split()[0] == "5"
    assert execute(["cache", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["entries"]) == 25
