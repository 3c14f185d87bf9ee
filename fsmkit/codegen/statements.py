"""The walk over executable content that the printers of all languages share."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import NoReturn, assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.emit import Emitter

Loop = stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement]
Choice = stmt.If[lang.Expr, stmt.Statement]


class StatementPrinter:
    """Prints statements to `out`: a language defines a method for each kind that it has.

    A kind without a method raises an error, so the target rejects charts that use it.
    """

    out: Emitter

    def statements(self, block: stmt.Block) -> None:
        """Print the statements of a handler, of a branch or of a loop."""
        for statement in block:
            self.statement(statement)

    def statement(self, statement: stmt.Statement) -> None:
        """Print one statement."""
        match statement:
            case stmt.Assign(location, value):
                self._assign(location, value)
            case stmt.Raise(event, arguments):
                self._raise(event, arguments)
            case stmt.Send():
                self._send(statement)
            case stmt.Cancel(name):
                self._cancel(name)
            case stmt.Log(label, values):
                self._log(label, values)
            case stmt.If():
                self._if(statement)
            case stmt.ForEach(item=item, index=index):
                with self._loop(statement) as (element, position):
                    self._set(item, element)
                    if index is not None:
                        self._set(index, position)
                    self.statements(statement.body)
            case stmt.Local(variable, value):
                assert value is not None  # noqa: S101  (typed so)
                self._local(variable, value)
            case stmt.Return(value):
                self._return(value)
            case stmt.Reply(value):
                self._reply(value)
            case stmt.CallOperation(call):
                self._call(call)
            case stmt.Fail(reason):
                self._fail(reason, is_raised=statement.is_raised)
            case stmt.Invoke(slot, arguments):
                self._invoke(slot, arguments)
            case _:
                assert_never(statement)

    def _assign(self, location: lang.Location, value: lang.Expr) -> None:
        _reject_hook(location, value)

    def _raise(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        _reject_hook(event, arguments)

    def _send(self, statement: stmt.Send) -> None:
        _reject_hook(statement)

    def _cancel(self, name: str) -> None:
        _reject_hook(name)

    def _log(self, label: str, values: tuple[lang.Expr, ...]) -> None:
        _reject_hook(label, values)

    def _if(self, statement: Choice) -> None:
        _reject_hook(statement)

    def _loop(self, statement: Loop) -> AbstractContextManager[tuple[str, str]]:
        """Open a loop; the result is the text of the element and that of its position."""
        _reject_hook(statement)

    def _set(self, variable: lang.Variable, text: str) -> None:
        """Print the assignment of a loop's variable."""
        _reject_hook(variable, text)

    def _local(self, variable: lang.Variable, value: lang.Expr) -> None:
        _reject_hook(variable, value)

    def _return(self, value: lang.Expr) -> None:
        _reject_hook(value)

    def _reply(self, value: lang.Expr) -> None:
        _reject_hook(value)

    def _call(self, call: lang.Call) -> None:
        _reject_hook(call)

    def _fail(self, reason: str, *, is_raised: bool) -> None:
        _reject_hook(reason, is_raised)

    def _invoke(self, slot: int, arguments: tuple[lang.Expr, ...]) -> None:
        _reject_hook(slot, arguments)


def _reject_hook(*parts: object) -> NoReturn:
    """Fail for a hook that a printer lacks: its target rejects such content before it prints."""
    raise TypeError(f"the printer has no hook for {parts}")
