"""What generated C calls: operations and sent events, which are methods of an object of Python."""

from __future__ import annotations

from fsmkit.codegen.c.host import print_host as print_functions
from fsmkit.codegen.pyext.members import Bound, Method, Module
from fsmkit.emit import Emitter
from fsmkit.texts.c import quoted


def print_host(out: Emitter, module: Module, bound: Bound) -> None:
    """Print the functions that a machine calls, and the methods that they stand for."""
    names, w = bound.names, module.wrapper
    p, chart = names.prefix, names.chart
    numbered = enumerate(bound.calls, bound.first_call)
    known = {method.function: _call(method, number) for number, method in numbered}
    never = "{-1, NULL, false},"
    operations = [f"{p}_{names.operations[operation.name]}" for operation in chart.operations]
    events = [f"{p}_send_{name}" for name in names.event_names]
    for what, functions in (("operations", operations), ("sent", events)):
        with out.block(f"static const fsm_py_call {w}_{what}_{p}[] = {{", "};"):
            out.lines([*(known.get(function, never) for function in functions), never])
        out.line()
    path = quoted("".join(slot + ": " for slot in names.path))
    of = f"{w}_of_{p}(m), &{p}_info"
    operate = f"fsm_py_operate({of}, {w}_operations_{p}, {path}, operation, given, result)"
    out.lines(["#undef FSM_HOST_CALL", "#undef FSM_HOST_SEND"])
    out.line(f"#define FSM_HOST_CALL(m, operation, given, result) {operate}")
    emit = f"fsm_py_emit({of}, {w}_sent_{p}, event, given)"
    out.line(f"#define FSM_HOST_SEND(m, event, given) {emit}")
    print_functions(out, names)


def _call(method: Method, number: int) -> str:
    said = quoted(f"the result of {method.name}")
    return f"{{{number}, {said}, {str(method.has_peer).lower()}}},"
