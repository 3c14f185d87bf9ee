"""Printers of expressions: targets print every node, each by a method that takes its class."""

from __future__ import annotations

from typing import get_args, get_type_hints

import pytest

from fsmkit.codegen.c.expressions.expressions import Printer as CPrinter
from fsmkit.codegen.javascript.expressions import Printer as JavaScriptPrinter
from fsmkit.codegen.python.expressions import Printer as PythonPrinter
from fsmkit.codegen.transitions.expressions import ModelPrinter
from fsmkit.export.uppaal.printing import Printer as UppaalPrinter
from fsmkit.language import EventType, Expr, Walk
from fsmkit.language.format import SourcePrinter
from fsmkit.language.printing import HOOKS
from fsmkit.verify.engines.c.conditions import ConditionPrinter

PRINTERS = (CPrinter, PythonPrinter, JavaScriptPrinter, ModelPrinter, SourcePrinter)
OTHERS = (UppaalPrinter, ConditionPrinter)


def test_every_node_has_a_hook() -> None:
    """A new class of node needs a row of `HOOKS`."""
    assert HOOKS.keys() == {*get_args(Expr), EventType}


@pytest.mark.parametrize("printer", PRINTERS)
def test_targets_print_every_node(printer: type[Walk[object]]) -> None:
    """Targets reject a chart by a finding, never by an error while printing."""
    assert [name for name in HOOKS.values() if not hasattr(printer, name)] == []


@pytest.mark.parametrize("printer", [*PRINTERS, *OTHERS])
def test_hooks_take_their_nodes(printer: type[Walk[object]]) -> None:
    """Type checkers cannot check calls by name."""
    for kind, name in HOOKS.items():
        hook = getattr(printer, name, None)
        if hook is not None:
            taken = get_type_hints(hook)["expr"]
            classes = get_args(taken) or (taken,)
            assert any(issubclass(kind, one) for one in classes), (printer, name)
