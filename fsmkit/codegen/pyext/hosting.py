"""What generated C calls: operations and sent events, which are methods of an object of Python."""

from __future__ import annotations

from fsmkit.analysis.host_events import sent_events
from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.header import declaration, parameters
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.pyext.members import Bound, Method, Module
from fsmkit.codegen.pyext.tracing import show_value
from fsmkit.codegen.pyext.values import Values
from fsmkit.emit import Emitter
from fsmkit.language import ArrayType, RecordType
from fsmkit.texts.c import quoted


def print_host(out: Emitter, module: Module, bound: Bound, values: Values) -> None:
    """Print the functions that a machine calls."""
    for number, method in enumerate(bound.calls):
        _call(out, module, bound, method, bound.first_call + number, values)
    names = bound.names
    known = {method.function for method in bound.calls}
    for index in sent_events(names.chart):
        function = f"{names.prefix}_send_{names.event_names[index]}"
        if function not in known:
            event = names.chart.events[index]
            taken = parameters(event.fields, names)
            out.line(f"void {function}({names.prefix} *m{taken}) /* is never sent */")
            with out.block("{"):
                out.line("(void)m;")
                out.lines(f"(void){names.field(part.name)};" for part in event.fields)
            out.line()


def _call(
    out: Emitter, module: Module, bound: Bound, method: Method, number: int, values: Values
) -> None:
    """Print how a method is called; where it raises, the step is left."""
    names = bound.names
    result = method.result
    ctype = "void" if result is None else storage(result, names.records).text
    count = len(method.parameters) + method.has_peer
    taken = [f"p{i}" for i in range(len(method.parameters))]
    out.line(f"{ctype} {method.function}({names.prefix} *m{_taken(method, names)})")
    with out.block("{"):
        out.line(f"fsm_object *o = {module.wrapper}_of_{names.prefix}(m);")
        pairs = list(zip(method.parameters, taken, strict=True))
        given = [values.give(part.type, text) for part, text in pairs]
        if method.has_peer:
            given.append("o->peer == 0u ? fsm_py_or_none(NULL) : fsm_py_string(o, o->peer)")
        passed = "".join(f"given[{i}], " for i in range(count))
        if count:
            with out.block(f"PyObject *given[{count}] = {{", "};"):
                out.lines(f"{text}," for text in given)
            out.line(f"fsm_py_ready(o, given, {count});")
        out.line("PyObject *answer = PyObject_CallMethodObjArgs(")
        out.line(f"    fsm_py_host(o), fsm_py_method(o, {number}), {passed}NULL);")
        out.line(f"fsm_py_done(o, {'given' if count else 'NULL'}, {count}, answer);")
        if result is not None:
            initial = "{0}" if isinstance(result, RecordType) else "0"
            out.line(f"{ctype} result = {initial};")
            what = quoted(f"the result of {method.name}")
            out.line(f"bool is_taken = {values.take(result, 'answer', what, 'result')};")
            out.lines(["Py_DECREF(answer);", "if (!is_taken)", "    fsm_py_break(o);"])
        else:
            out.line("Py_DECREF(answer);")
        if module.traced and not method.is_event:
            out.line(f"{module.wrapper}_begun_{names.prefix}(o);")
            out.line(f"fsm_py_write(o, {quoted(f'op {method.shown}')});")
            for part, text in pairs:
                show_value(out, names, part.type, text)
            if result is not None:
                out.line('fsm_py_write(o, " =");')
                show_value(out, names, result, "result")
            out.line("fsm_py_line(o);")
        if result is not None:
            out.line("return result;")
    out.line()


def _taken(method: Method, names: Names) -> str:
    """Return the parameters, by number: no name of the chart meets those of the function."""
    texts = [
        f", const {storage(part.type, names.records).text} *p{i}"
        if isinstance(part.type, ArrayType)
        else f", {declaration(part.type, f'p{i}', names)}"
        for i, part in enumerate(method.parameters)
    ]
    return "".join(texts)
