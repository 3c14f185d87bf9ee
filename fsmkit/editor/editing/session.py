"""A chart file that is edited by operations: history, writing, changes by other programs."""

from __future__ import annotations

import os
import tempfile
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from fsmkit.diagnostics import FsmkitError, Source, fail
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Document
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, read
from fsmkit.editor.editing.documents import state_of
from fsmkit.editor.editing.values import rejected

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
        self._undo: list[str] = []
        self._redo: list[str] = []
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
        if text == self.text and not self.is_new:
            return
        self._write(text)
        self._undo = [*self._undo[-MOST_TEXTS:], self.text]
        self._redo = []
        self._set(text)

    def undo(self) -> None:
        """Restore the text before the last edit, byte for byte."""
        self.refresh()
        if not self._undo:
            raise rejected(
                "there is nothing to undo",
                help="a change by another program ends the history; undo it there",
            )
        text = self._undo[-1]
        self._write(text)
        self._redo.append(self.text)
        self._undo.pop()
        self._set(text)

    def redo(self) -> None:
        """Restore the text before the last `undo`."""
        self.refresh()
        if not self._redo:
            raise rejected("there is nothing to do again", help="undo an edit first")
        text = self._redo[-1]
        self._write(text)
        self._undo.append(self.text)
        self._redo.pop()
        self._set(text)

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
        if self.path.is_symlink():
            raise fail(
                "unwritable-output",
                f"`{self.path.name}` is a symbolic link, through which nothing is written",
                help="edit the file that it names",
            )
        if self.path.exists() and not os.access(self.path, os.W_OK):
            raise fail(
                "unwritable-output",
                f"`{self.path.name}` is read-only; the edit was not made",
                help="make the file writable, or edit a copy",
            )
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
