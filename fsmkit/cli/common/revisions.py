"""A chart at a revision of git, or with the content that git hands over, with its bases."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from fsmkit.diagnostics import Findings, fail
from fsmkit.document.document import Document

SUFFIXES = (".yaml", ".yml", ".scxml", ".xml", ".json", ".toml")
"""Files that a chart may refer to; and those with the suffix of the chart."""
MOST_BYTES = 50_000_000


@dataclass(frozen=True)
class ReplacedContent:
    """A file with another content than the disk has; for `fsmkit.chart.loading.TEXTS`."""

    path: Path
    held: bytes

    def content(self, path: Path) -> bytes | None:
        """Return the content of the file; None for others."""
        return self.held if path == self.path else None

    def known(self, path: Path, content: bytes) -> tuple[Document, Findings] | None:
        """Return nothing: each file is read anew."""
        del path, content
        return None

    def keep(self, path: Path, content: bytes, document: Document, findings: Findings) -> None:
        """Keep nothing."""


@contextmanager
def with_revision(path: Path, revision: str) -> Iterator[Path]:
    """Give the path of a copy of a file at a revision, with the charts of the repository.

    Raises `FsmkitError` (``no-revision``).
    """
    folder = path.resolve().parent
    top = Path(_git(folder, "rev-parse", "--show-toplevel").decode().strip())
    name = path.resolve().relative_to(top.resolve()).as_posix()
    commit = _git(folder, "rev-parse", "--verify", "--end-of-options", f"{revision}^{{commit}}")
    listed = _git(top, "ls-tree", "-r", "-z", "--name-only", commit.decode().strip()).decode()
    names = [each for each in listed.split("\0") if _is_read(each, path.suffix)]
    if name not in names:
        raise fail(
            "no-revision",
            f"revision `{revision}` has no file `{name}`",
            help=f"`git log -- {name}` lists the revisions that have it",
        )
    with tempfile.TemporaryDirectory() as created:
        for each, content in _contents(top, commit.decode().strip(), names):
            target = Path(created, each)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        yield Path(created, name)


def _is_read(name: str, suffix: str) -> bool:
    parts = PurePosixPath(name).parts
    return name.endswith((*SUFFIXES, suffix)) and ".." not in parts and not name.startswith("/")


def _contents(top: Path, commit: str, names: list[str]) -> Iterator[tuple[str, bytes]]:
    """Yield the content of files of a commit."""
    objects = "".join(f"{commit}:{name}\n" for name in names if "\n" not in name)
    output = _git(top, "cat-file", "--batch", given=objects.encode())
    for name in names:
        head, _, output = output.partition(b"\n")
        size = int(head.split()[-1])
        yield name, output[:size]
        output = output[size + 1 :]


@contextmanager
def with_content(path: Path, content: bytes) -> Iterator[Path]:
    """Give the path of a file with other content, beside links to the files around the real one.

    So that a chart finds its bases: the folders up to the repository, four at most, have links.
    """
    real = path.resolve()
    folders = [real.parent]
    while len(folders) < 4 and not (folders[-1] / ".git").exists():
        folders.append(folders[-1].parent)
    with tempfile.TemporaryDirectory() as created:
        here = Path(created)
        for folder, below in zip(reversed(folders), [*reversed(folders[:-1]), real], strict=True):
            for each in folder.iterdir() if folder.is_dir() else ():
                if each.name not in (below.name, ".git"):
                    (here / each.name).symlink_to(each)
            if below is not real:
                here /= below.name
                here.mkdir()
        there = here / real.name
        there.write_bytes(content)
        yield there


def _git(folder: Path, *arguments: str, given: bytes = b"") -> bytes:
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=folder, input=given, capture_output=True, check=True
        )
    except FileNotFoundError as error:
        raise fail(
            "no-revision", "`git` is not installed", help="compare two files instead"
        ) from error
    except subprocess.CalledProcessError as error:
        message = error.stderr.decode(errors="replace").strip().splitlines()
        raise fail(
            "no-revision",
            f"git does not give the revision: {message[0] if message else error}",
            help="name a commit, a branch or a tag of the repository of the file",
        ) from error
    return done.stdout
