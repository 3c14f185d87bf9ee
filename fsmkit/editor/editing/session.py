"""A chart file that is edited by operations: history, writing, changes by other programs."""

from __future__ import annotations

import os
import tempfile
from collections import OrderedDict
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from fsmkit.diagnostics import FsmkitError, Source, fail
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Document
from fsmkit.document.project import project_of
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, read
from fsmkit.editor.editing.documents import state_of
from fsmkit.editor.editing.renaming import Renaming, renaming_of
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.index.files import normal
from fsmkit.editor.index.workspace import Workspace

MOST_TEXTS = 200
"""Texts that are kept to rebase operations on them, and steps of undo."""
OPERATIONS: Mapping[str, type[Any]] = {kind.__name__: kind for kind in op.Operation.__args__}
"""The operations by their names in messages."""


def read_operation(fields: Mapping[str, Any]) -> op.Operation:
    """Return an operation from a message: its name under ``op``, and its fields.

    Raises:
        FsmkitError: ``edit-rejected`` for unknown names and wrong values.

    """
    given = dict(fields)
    name = given.pop("op", None)
    kind = OPERATIONS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise rejected(f"there is no operation `{name}`", help=f"use {', '.join(OPERATIONS)}")
    try:
        found: op.Operation = msgspec.convert(given, kind)
    except msgspec.ValidationError as error:
        raise rejected(f"the operation `{name}` is wrong: {error}", help="see its fields") from None
    return found


def hash_of(text: str) -> str:
    """Return the hash that an operation names for the text it was made for."""
    return sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


@dataclass(frozen=True, slots=True)
class OtherFile:
    """A file that a renaming changed besides the edited one."""

    path: Path
    before: bytes
    after: bytes


@dataclass(frozen=True, slots=True)
class Step:
    """A step of undo or redo: the text to restore, and the other files that change with it."""

    text: str
    others: tuple[OtherFile, ...] = ()


class EditSession:
    """Edits one file. It is read and written as UTF-8, with its kind of line ends.

    Args:
        path: The file; it need not exist yet.
        text: The text of a new file.

    """

    def __init__(self, path: Path, text: str = "") -> None:
        self.path = path
        self._disk = self._bytes()
        self.is_new = self._disk is None
        self.text = text if self._disk is None else self._decoded(self._disk)
        self.is_edited = False
        """Whether this session has written the file."""
        self._undo: list[Step] = []
        self._redo: list[Step] = []
        self._known: OrderedDict[str, str] = OrderedDict()
        self._remember()

    @property
    def hash(self) -> str:
        """The hash of the present text."""
        return hash_of(self.text)

    @property
    def source(self) -> Source:
        """The present text as a source."""
        return Source(str(self.path), self.text)

    @property
    def can_undo(self) -> bool:
        """Whether an edit can be undone."""
        return bool(self._undo)

    @property
    def can_redo(self) -> bool:
        """Whether an edit can be done again."""
        return bool(self._redo)

    # --- edits --------------------------------------------------------------------------------

    def edit(self, operations: Sequence[op.Operation], text_hash: str) -> None:
        """Apply operations as one step of undo, and write the file.

        Args:
            operations: The operations; each is made for the text after the one before.
            text_hash: The hash of the text that the first was made for. If the text has changed
                since, they are rebased, which succeeds if their items still exist.

        Raises:
            FsmkitError: ``edit-rejected``, or ``unwritable-output``; nothing has changed then.

        """
        self.refresh()
        text = self._applied(operations, text_hash)
        if text == self.text and not self.is_new:
            return
        self._write(text)
        self._done(text)

    def preview(self, operations: Sequence[op.Operation], text_hash: str) -> Source:
        """Return the text that operations would give; nothing is written. Raises as `edit` does."""
        return Source(str(self.path), self._applied(operations, text_hash))

    def _applied(self, operations: Sequence[op.Operation], text_hash: str) -> str:
        made_for = self._known.get(text_hash)
        if made_for is None:
            raise rejected(
                "the operation was made for an unknown text", help="repeat it in the present chart"
            )
        text = self.text
        for operation in operations:
            fitted = operation
            if made_for != self.text:
                fitted = rebased(operation, self._at(made_for), self._at(text))
            text = apply_edits(text, apply(Source(str(self.path), text), fitted))
        return text

    def _done(self, text: str, others: tuple[OtherFile, ...] = ()) -> None:
        """Remember an edit as a step of undo."""
        self._undo = [*self._undo[-MOST_TEXTS:], Step(self.text, others)]
        self._redo = []
        self._set(text)

    # --- renaming in other files --------------------------------------------------------------

    def renaming(self, operation: op.RenameSymbol) -> Renaming:
        """Return the changes for a new name in all files below the folder of the project.

        Without a project file, it is the folder of the chart.

        Raises:
            FsmkitError: ``edit-rejected`` if the name is impossible.

        """
        path = Path(normal(self.path))
        project = None
        with suppress(FsmkitError):  # errors in a project file are findings
            project = project_of(path)
        folder = path.parent if project is None else Path(normal(project.path)).parent
        workspace = Workspace((folder,))
        workspace.set_text(path, self.text.encode("utf-8", "surrogatepass"))
        return renaming_of(workspace, path, operation)

    def rename(self, operation: op.RenameSymbol, confirmed: Collection[str]) -> None:
        """Rename a symbol in the file and in all others that refer to it, as one step of undo.

        Args:
            operation: The renaming.
            confirmed: The other files, as `other_files` names them. If others refer to the symbol
                now, nothing is changed.

        Raises:
            FsmkitError: ``edit-rejected``, or ``unwritable-output``; nothing has changed then.

        """
        self.refresh()
        renaming = self.renaming(operation)
        if sorted(confirmed) != sorted(self.other_files(renaming)):
            raise rejected("other files refer to the name now", help="rename it again")
        own = Path(normal(self.path))
        text = renaming.text(own, self.text)
        others = tuple(
            self._renamed(path, renaming) for path in sorted(renaming.places) if path != own
        )
        with self._changed_others(others, is_back=False):
            self._write(text)
        self._done(text, others)

    def other_files(self, renaming: Renaming) -> list[str]:
        """Return the files that a renaming changes besides this one, relative to its folder."""
        own = Path(normal(self.path))
        names = (os.path.relpath(path, own.parent) for path in renaming.places if path != own)
        return sorted(names)

    def _renamed(self, path: Path, renaming: Renaming) -> OtherFile:
        try:
            before = path.read_bytes()
            text = before.decode("utf-8").replace("\r\n", "\n")
        except OSError as error:
            raise self._failed("read", error) from error
        except UnicodeDecodeError as error:
            raise rejected(f"`{path.name}` is not valid UTF-8", help="save it as UTF-8") from error
        is_dos = b"\r\n" in before
        if any(span.source.text != text for span in renaming.places[path]):
            raise rejected(f"`{path.name}` was changed meanwhile", help="rename it again")
        text = renaming.text(path, text)
        return OtherFile(path, before, (text.replace("\n", "\r\n") if is_dos else text).encode())

    @contextmanager
    def _changed_others(self, others: tuple[OtherFile, ...], *, is_back: bool) -> Iterator[None]:
        """Change other files; restore them if one of them or the edited file cannot be written."""
        written: list[tuple[Path, bytes]] = []
        try:
            for one in others:
                old, new = (one.after, one.before) if is_back else (one.before, one.after)
                if not one.path.is_file() or one.path.read_bytes() != old:
                    raise rejected(
                        f"`{one.path.name}` was changed by another program since",
                        help="change the name back there",
                    )
                _require_writable(one.path)
                write_atomically(one.path, new)
                written.append((one.path, old))
            yield
        except (OSError, FsmkitError) as error:
            for path, content in written:
                with suppress(OSError):
                    write_atomically(path, content)
            if isinstance(error, OSError):
                raise self._failed("write", error) from error
            raise

    def undo(self) -> None:
        """Restore the text before the last edit, byte for byte, and files that it renamed in."""
        self.refresh()
        if not self._undo:
            raise rejected(
                "there is nothing to undo",
                help="a change by another program ends the history; undo it there",
            )
        step = self._undo[-1]
        with self._changed_others(step.others, is_back=True):
            self._write(step.text)
        self._redo.append(Step(self.text, step.others))
        self._undo.pop()
        self._set(step.text)

    def redo(self) -> None:
        """Restore the text before the last `undo`."""
        self.refresh()
        if not self._redo:
            raise rejected("there is nothing to do again", help="undo an edit first")
        step = self._redo[-1]
        with self._changed_others(step.others, is_back=False):
            self._write(step.text)
        self._undo.append(Step(self.text, step.others))
        self._redo.pop()
        self._set(step.text)

    def refresh(self) -> bool:
        """Load the file if another program changed it; return whether it did.

        The history ends there: undo never removes a change of another program.
        """
        found = self._bytes()
        if found is None or found == self._disk:
            return False
        self._disk, self.is_new = found, False
        self._undo, self._redo = [], []
        self._set(self._decoded(found))
        return True

    def _at(self, text: str) -> Document:
        return read(Source(str(self.path), text))

    def _set(self, text: str) -> None:
        self.text = text
        self._remember()

    def _remember(self) -> None:
        self._known[self.hash] = self.text
        self._known.move_to_end(self.hash)
        while len(self._known) > MOST_TEXTS:
            self._known.popitem(last=False)

    # --- files --------------------------------------------------------------------------------

    def _bytes(self) -> bytes | None:
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._failed("read", error) from error

    def _decoded(self, content: bytes) -> str:
        try:
            return content.decode("utf-8").replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            raise fail(
                "invalid-encoding",
                f"`{self.path.name}` is not valid UTF-8",
                help="save the file as UTF-8",
            ) from error

    def _write(self, text: str) -> None:
        """Write the file atomically: it has the old text or the new one, at any time."""
        _require_writable(self.path)
        is_dos = self._disk is not None and b"\r\n" in self._disk
        content = (text.replace("\n", "\r\n") if is_dos else text).encode("utf-8")
        try:
            write_atomically(self.path, content)
        except OSError as error:
            raise self._failed("write", error) from error
        self._disk, self.is_new, self.is_edited = content, False, True

    def _failed(self, what: str, error: OSError) -> FsmkitError:
        rule = "unwritable-output" if what == "write" else "unreadable-file"
        message = f"cannot {what} `{self.path.name}`: {error.strerror or error}"
        kept = "; the edit was not made" if what == "write" else ""
        return fail(rule, message + kept, help="correct that, and repeat the edit")


def _require_writable(path: Path) -> None:
    """Reject a symbolic link and a read-only file."""
    if path.is_symlink():
        raise fail(
            "unwritable-output",
            f"`{path.name}` is a symbolic link, through which nothing is written",
            help="edit the file that it names",
        )
    if path.exists() and not os.access(path, os.W_OK):
        raise fail(
            "unwritable-output",
            f"`{path.name}` is read-only; the edit was not made",
            help="make the file writable, or edit a copy",
        )


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file that has the old content or the new one at any time; raises `OSError`."""
    name = ""
    try:
        with tempfile.NamedTemporaryFile(
            dir=path.parent, prefix=f".{path.name}.", delete=False
        ) as file:
            name = file.name
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            Path(name).chmod(path.stat().st_mode & 0o7777)
        else:
            mask = os.umask(0)
            os.umask(mask)
            Path(name).chmod(0o666 & ~mask)
        Path(name).replace(path)
    except OSError:
        with suppress(OSError):
            if name:
                Path(name).unlink()
        raise


def rebased(operation: op.Operation, old: Document, new: Document) -> op.Operation:
    """Return an operation for another text, in which its items still exist.

    Raises:
        FsmkitError: ``edit-rejected`` if an item is gone or ambiguous.

    """
    index = getattr(operation, "index", None)
    if index is None or (isinstance(operation, op.SetKey) and operation.index is None):
        return operation  # it names states, which the operation requires to exist
    name = operation.state if isinstance(operation, op.SetKey) else getattr(operation, "source", "")
    before, after = state_of(old, name).transitions, state_of(new, name).transitions
    if not 0 <= index < len(before):
        return operation
    if index < len(after) and after[index] == before[index]:
        return operation
    same = [number for number, one in enumerate(after) if one == before[index]]
    if len(same) != 1:
        raise rejected(f"the transition of `{name}` was changed meanwhile", help="select it again")
    changes: dict[str, Any] = {"index": same[0]}
    return replace(operation, **changes)
