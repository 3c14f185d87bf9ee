"""The C of an extension module around a generated machine: the tables for ``fsm_python.h``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.recording import recording_source
from fsmkit.codegen.pyext.definitions import definitions
from fsmkit.codegen.pyext.members import Bound, Method, Module, fields_of, posted
from fsmkit.emit import Emitter, plain, printing, telling
from fsmkit.emit.c import comment, quoted

RECORDING = "#define FSM_PY_RECORDED\n"
"""The first line of a file with a recorded machine."""
ONCE = """\
#include "fsm.h"
#include "fsm.c"
#include "fsm_python_hooks.h"
"""
"""The next lines, once for all modules in the file."""
SAVING = '#include "fsm_save.c"\n'
"""The next line if machines are saved."""
COVERING = '#include "fsm_coverage.c"\n'
"""The next line if coverage is counted."""
KEYWORDS = "METH_FASTCALL | METH_KEYWORDS"


@printing
def wrapper_text(module: Module) -> str:
    """Return the text of the compiled file."""
    head = f"/* {module.name}_python.c: {comment(module.chart.name)} as an extension module\n"
    head += f" * of CPython, all of it: compile this. {NOTICE} */\n"
    saving = SAVING if module.saved else ""
    saving += COVERING if module.covered else ""
    library = '#include "fsm_python.h"\n'
    parts = (machine_part(module), library, python_part(module))
    recording = RECORDING if module.recorded else ""
    return head + recording + ONCE + saving + "\n" + "\n".join(parts)


# --- before the headers of Python, which define macros --------------------------------------------


def machine_part(module: Module) -> str:
    """Return the machines with their hooks and tables, and the functions they call."""
    out = Emitter()
    by_prefix = {bound.names.prefix: bound for bound in module.bound.everyone}

    def before(names: Names) -> list[str]:
        return _before(module, by_prefix[names.prefix])

    if module.recorded:
        records = recording_source(module.machine.family, before, _host)
        out.lines(records.rstrip("\n").split("\n"))
    else:
        for bound in module.bound.everyone:
            out.lines([*before(bound.names), f'#include "{bound.names.prefix}.c"', ""])
            print_host(out, bound.names)
    out.lines([f'#include "{module.bound.names.prefix}_info.c"', ""])
    _machines(out, module, module.bound, ())
    return out.finish()


def _before(module: Module, bound: Bound) -> list[str]:
    """Return the lines before the source of a machine."""
    is_kept = module.is_calling and bound is module.bound
    marks = {"FSM_PY_TRACED": module.traced, "FSM_PY_KEEPS": is_kept}
    lines = [f'#include "{bound.names.prefix}.h"', "#undef FSM_PY_THIS"]
    lines.append(f"#define FSM_PY_THIS {_table_of(module, bound)}")
    for mark, is_set in marks.items():
        lines += [f"#undef {mark}", *([f"#define {mark}"] if is_set else [])]
    return [*lines, '#include "fsm_python_hooks.h"', "static const fsm_py_machine FSM_PY_THIS;"]


def _host(names: Names) -> list[str]:
    """Return the functions of the host that a machine calls."""
    out = Emitter()
    print_host(out, names)
    return out.finish().rstrip("\n").split("\n")


def _machines(out: Emitter, module: Module, bound: Bound, place: tuple[str, ...]) -> None:
    """Print the tables of the machines in slots, then that of their holder."""
    for inside, slot in zip(bound.invoked, bound.names.slots, strict=True):
        _machines(out, module, inside, (*place, slot))
    at = f"offsetof({module.bound.names.prefix}, {'.'.join(place)})" if place else "0"
    _machine(out, module, bound, at)


def _table_of(module: Module, bound: Bound) -> str:
    return f"{module.wrapper}_{bound.names.prefix}"


def _machine(out: Emitter, module: Module, bound: Bound, place: str) -> None:
    """Print the table of a machine: its location, and the methods that its calls invoke."""
    names, own = bound.names, _table_of(module, bound)
    p, chart = names.prefix, names.chart
    numbered = enumerate(bound.calls, bound.first_call)
    known = {method.function: _call(method, number) for number, method in numbered}
    operations = [f"{p}_{names.operations[operation.name]}" for operation in chart.operations]
    events = [f"{p}_send_{name}" for name in names.event_names]
    tables = [
        _table(out, "const fsm_py_call", f"{own}_{name}", [known.get(f, NEVER) for f in functions])
        for name, functions in (("operations", operations), ("sent", events))
    ]
    path = quoted("".join(f"{plain(slot)}: " for slot in names.path))
    numbers = f"{bound.first_call}, {bound.first_call + len(bound.calls)}"
    row = f"&{p}_info, {place}, {path}, {', '.join(tables)}, {numbers}"
    out.lines([f"static const fsm_py_machine {own} = {{{row}}};", ""])


NEVER = "{-1, NULL, false}"


def _call(method: Method, number: int) -> str:
    said = quoted(f"the result of {method.name}")
    return f"{{{number}, {said}, {str(method.has_peer).lower()}}}"


def _table(out: Emitter, ctype: str, name: str, rows: Sequence[str]) -> str:
    """Print an array; return its name, or NULL if it is empty."""
    if not rows:
        return "NULL"
    with out.block(f"static {ctype} {name}[] = {{", "};"):
        out.lines(f"{row}," for row in rows)
    out.line()
    return name


# --- the module -----------------------------------------------------------------------------------


def python_part(module: Module) -> str:
    """Return the methods of events, and the tables of the class and of the module."""
    bound, chart, w = module.bound, module.chart, module.wrapper
    class_ = bound.member.names.machine
    out = Emitter()
    text = "const char *const"
    events = [_event(out, f"{w}_{event.index}", event.name, fields_of(event.fields))
              for event in chart.events]  # fmt: skip
    rows = ["FSM_PY_METHODS", *_of_events(out, module)]
    rows += [_coverage(out, module)] * module.covered
    rows += ["FSM_PY_SAVING"] * module.saved + ["FSM_PY_TRACING"] * module.traced
    everyone = [f"&{_table_of(module, each)}" for each in bound.everyone]
    names = bound.member.names.variables
    shown = [names[v.name] for v in (*chart.data, *chart.outputs, *chart.inputs)]
    attributes = [f"FSM_PY_VARIABLE({quoted(name)}, {n})" for n, name in enumerate(shown)]
    attributes += ["FSM_PY_ATTRIBUTES", *(["FSM_PY_HELD(trace)"] * module.traced)]
    attributes += ["FSM_PY_SEEN(records)"] * module.recorded
    doc = f"{class_}: create it, `start` it, `post` events, `run` it to a time."
    table = {
        "module": f"FSM_PY_MODULE({quoted(module.name)}, "
        f"{quoted(chart.doc or 'The machine ' + chart.name + '.')})",
        "type": quoted(f"{module.name}.{class_}"),
        "doc": quoted(f"{class_}(operations=None)\n--\n\n{doc}"),
        "arguments": quoted(f"|O:{class_}"),
        "file": quoted(f"<{module.name}>"),
        "driver": f"&{bound.names.prefix}_driver",
        "saved_size": f"{bound.names.upper}_SAVED_BYTES" if module.saved else "0u",
        "calls": str(module.is_calling).lower(),
        "replies": str(module.is_replying).lower(),
        "machines": _table(out, "const fsm_py_machine *const", f"{w}_machines",
                           [*everyone, "NULL"]),
        "events": _table(out, "const fsm_py_event", f"{w}_events", events),
        "host": _table(out, text, f"{w}_host", [quoted(each.name) for each in module.calls]),
        "host_count": str(len(module.calls)),
        "methods": _table(out, "PyMethodDef", f"{w}_methods", [*rows, "{NULL, NULL, 0, NULL}"]),
        "attributes": _table(out, "PyGetSetDef", f"{w}_attributes",
                             [*attributes, "{NULL, NULL, NULL, NULL, NULL}"]),
        "python": f"{w}_python",
        "inputs_size": _inputs_size(module),
        "restored": f"{w}_restored" if module.recorded else "NULL",
    }  # fmt: skip
    out.line(f"static const char {w}_python[] =")
    lines = [quoted(f"{line}\n") for line in definitions(module).rstrip("\n").split("\n")]
    with out.indented():
        out.lines([*lines[:-1], f"{lines[-1]};"])
    if module.recorded:
        p = bound.names.prefix
        out.line(f"static void {w}_restored(void *m, uint32_t now)")
        with out.block("{"):
            out.line(f"fsm_{p}_restored(({p} *)m, now);")
        out.line()
    _print_class(out, module, table)
    return out.finish()


def _coverage(out: Emitter, module: Module) -> str:
    """Print the method that returns the coverage counters, if counted; return its row."""
    if not module.covered:
        return ""
    own = f"{module.wrapper}_coverage"
    out.line(f"static void {own}_write(void *arg, const uint8_t *bytes, size_t count)")
    with out.block("{"):
        out.line(
            "PyObject *more = PyBytes_FromStringAndSize((const char *)bytes, (Py_ssize_t)count);"
        )
        out.line("if (more == NULL) {")
        out.lines(["    Py_CLEAR(*(PyObject **)arg);", "}"])
        out.line("PyBytes_ConcatAndDel((PyObject **)arg, more);")
    out.line()
    out.line(f"static PyObject *{own}(PyObject *object, PyObject *nothing)")
    with out.block("{"):
        out.lines(["(void)object;", "(void)nothing;"])
        out.line("PyObject *data = PyBytes_FromStringAndSize(NULL, 0);")
        out.line(f"{module.bound.names.prefix}_coverage({own}_write, &data);")
        out.line("return data;")
    out.line()
    doc = quoted(docstring_with_signature("coverage", (), COVERAGE))
    return f'{{"coverage", {own}, METH_NOARGS, {doc}}}'


COVERAGE = "Return what tests reached of all machines of this class."


def _inputs_size(module: Module) -> str:
    is_read = module.recorded and module.chart.inputs
    return f"(uint32_t)sizeof(fsm_{module.bound.names.prefix}_inputs)" if is_read else "0u"


def _print_class(out: Emitter, module: Module, table: Mapping[str, str]) -> None:
    with out.block(f"static fsm_py_class {module.wrapper} = {{", "};"):
        out.lines(f"{value}, /* {name} */" for name, value in table.items())
    out.line()
    out.line(f"PyMODINIT_FUNC PyInit_{module.name}(void)")
    with out.block("{"):
        out.line(f"return PyModuleDef_Init(&{module.wrapper}.module);")


def _event(out: Emitter, own: str, name: str, fields: Sequence[str]) -> str:
    """Print the names of an event's fields, for Python and messages."""
    text = "const char *const"
    listed = _table(out, text, f"{own}_fields", [quoted(field) for field in fields])
    said = _table(out, text, f"{own}_said", [quoted(name + ": " + field) for field in fields])
    return f"{{{listed}, {said}}}"


def _of_events(out: Emitter, module: Module) -> Iterator[str]:
    """Print `post_` and `dispatch_` for each event; yield their rows."""
    put = ("Put `", "` into the queue; False if that is full or the machine does not run.")
    take = ("Process `", "` at once; whether it enabled a transition.")
    calls = str(module.is_calling).lower()
    for event in posted(module.chart):
        name = module.bound.member.names.events[event.index]
        shown = fields_of(event.fields)
        macro, flags = ("EVENT", KEYWORDS) if shown else ("PLAIN", "METH_NOARGS")
        for verb, doc in (("post", put), ("dispatch", take)):
            method, function = f"{verb}_{name}", f"{module.wrapper}_{verb}_{event.index}"
            is_posted = str(verb == "post").lower()
            passed = [function, module.bound.names.prefix, is_posted, calls, str(event.index)]
            passed += [quoted(method)] if shown else []
            out.line(f"FSM_PY_{macro}({', '.join(passed)})")
            documentation = quoted(
                docstring_with_signature(method, shown, doc[0] + event.name + doc[1])
            )
            yield f"{{{quoted(method)}, FSM_PY_CALL({function}), {flags}, {documentation}}}"
    out.line()


@telling
def docstring_with_signature(name: str, parameters: Sequence[str], doc: str) -> str:
    """Return a documentation string that starts with the signature in Python's format."""
    return f"{name}({', '.join(('$self', *parameters))})\n--\n\n{doc}"
