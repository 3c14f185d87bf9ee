from __future__ import annotations

import os
from pathlib import Path

import pytest

from fsmkit.cli.common.writing import write_files
from fsmkit.diagnostics import FsmkitError


def test_writes_all_and_makes_folders(tmp_path: Path) -> None:
    write_files({tmp_path / "a/b/c.txt": "ü\n", tmp_path / "d.png": b"\x89\r\n"})
    assert (tmp_path / "a/b/c.txt").read_bytes() == b"\xc3\xbc\n"
    assert (tmp_path / "d.png").read_bytes() == b"\x89\r\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "d.png"]


def test_keeps_the_mode_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "run.sh"
    path.write_text("old")
    path.chmod(0o750)
    write_files({path: "new"})
    assert path.stat().st_mode & 0o777 == 0o750
    assert path.read_text() == "new"


@pytest.mark.parametrize("place", ["folder", "file/under", "nul\0l", "x" * 300])
def test_all_or_nothing(tmp_path: Path, place: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("kept")
    files = {tmp_path / "new/first": "1", tmp_path / "file": "2", tmp_path / place: "3"}
    with pytest.raises(FsmkitError) as caught:
        write_files(files)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.rule.name == "unwritable-output"
    assert diagnostic.help is not None
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]
    assert (tmp_path / "file").read_text() == "kept"


def test_renames_are_undone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_text("before")
    replace = Path.replace

    def failing(self: Path, target: Path) -> Path:
        if target.name == "c":
            raise OSError(5, "Input/output error")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(FsmkitError, match="input/output error"):
        write_files({tmp_path / "a": "after", tmp_path / "b": "", tmp_path / "c": ""})
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_text() == "before"


def test_a_link_leads_to_the_file_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "behind").write_text("old")
    for name, target in (("link", "behind"), ("dangling", "new")):
        (tmp_path / name).symlink_to(target)
        write_files({tmp_path / name: "text"})
        assert (tmp_path / name).is_symlink()
        assert (tmp_path / target).read_text() == "text"


@pytest.mark.parametrize(
    ("link", "name"), [("m.c", "m.c"), ("sub", "sub/m.c"), ("null", "null")], ids=str
)
def test_a_link_out_of_the_folder_that_was_named_is_not_followed(
    link: str, name: str, tmp_path: Path
) -> None:
    folder, behind = tmp_path / "out", tmp_path / "behind"
    folder.mkdir()
    behind.mkdir()
    (behind / "m.c").write_text("precious")
    leads_to = {"m.c": behind / "m.c", "sub": behind, "null": Path(os.devnull)}[link]
    (folder / link).symlink_to(leads_to)
    with pytest.raises(FsmkitError, match="a link leads from there"):
        write_files({folder / "m.h": "header", folder / name: "code"}, folder)
    assert (behind / "m.c").read_text() == "precious"
    assert not (folder / "m.h").exists()


def test_links_to_and_within_the_folder_that_was_named_are_followed(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to("real")
    (tmp_path / "real" / "m.c").symlink_to("n.c")
    write_files({tmp_path / "out" / "m.c": "code"}, tmp_path / "out")
    assert (tmp_path / "real" / "n.c").read_text() == "code"


@pytest.mark.only_where(hasattr(os, "mkfifo"), "there are no pipes with names")
def test_a_pipe_is_written_and_stays(tmp_path: Path) -> None:
    """So does `/dev/null`, which a file must not take the place of, root or not."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_files({pipe: "text", tmp_path / "file": "beside"})
    assert os.read(reader, 99) == b"text"
    os.close(reader)
    assert pipe.is_fifo()
    assert (tmp_path / "file").read_text() == "beside"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "pipe"]


def test_a_dash_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FsmkitError, match=r"`/dev/stdout` prints"):
        write_files({Path("-"): "text"})
    assert not list(tmp_path.iterdir())
