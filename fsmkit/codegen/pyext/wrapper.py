"""The C of an extension module around a generated machine. This file is its table of contents."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Data, Event
from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.pyext.definitions import definitions
from fsmkit.codegen.pyext.hosting import print_host
from fsmkit.codegen.pyext.members import Bound, Module, fields_of, posted
from fsmkit.codegen.pyext.saving import LIBRARY, SAVED_METHODS
from fsmkit.codegen.pyext.stepping import LOADING, MAKING, METHODS, OBJECT, VARIABLES, WITHIN
from fsmkit.codegen.pyext.tracing import fill, print_hook_functions, print_hooks
from fsmkit.emit import Emitter
from fsmkit.texts import printing, telling
from fsmkit.texts.c import comment, quoted

KEYWORDS = "METH_FASTCALL | METH_KEYWORDS"
CAST = "(PyCFunction)(void (*)(void))"
MACROS = frozenset({"errno", "stdin", "stdout", "stderr", "unix", "linux", "environ", "signgam"})
"""Lower-case macros of a C library."""
FAMILIES = ("st_", "sa_", "si_", "h_", "s6_", "d_", "ru_", "sigev_", "tm_", "un_")
"""How others begin."""

FIXED = (
    ("start", KEYWORDS, "now=0", "Begin, or begin anew, at a time in ticks."),
    ("run", KEYWORDS, "now", "Do all that is to be done until a time; whether it goes on running."),
    ("post", "METH_FASTCALL", "event, /, *payload", "Put an event into the queue; False if full."),
    ("dispatch", KEYWORDS, "event, /, *payload, now=None", "Process one event at once."),
    ("next_deadline", "METH_NOARGS", "", "Return when the first timer is due; None if none is."),
    ("is_in", "METH_O", "state, /", "Whether the state of that name is active."),
    ("active", "METH_NOARGS", "", "Return the names of the active atomic states."),
)
"""Methods that do not depend on the chart: name, flags, arguments, what they do."""

SAVE = "Return the machine as bytes, timers with the time they have left."
BACK = "Go on from what was saved, at a time in ticks."

Method = tuple[str, str, str, str]
"""Name in Python, function, flags, documentation with its signature."""


@printing
def wrapper_text(module: Module) -> str:
    """Return the text of the one file that is compiled."""
    out = Emitter()
    out.line(f"/* {module.name}_python.c: {comment(module.chart.name)} as an extension module")
    out.line(f" * of CPython, all of it: compile this. {NOTICE} */")
    out.lines(['#include "fsm.h"', '#include "fsm.c"', ""])
    if module.saved:
        out.text(LIBRARY)
        out.line()
    return f"{out.finish()}\n{machine_part(module)}\n{python_part(module)}"


def machine_part(module: Module) -> str:
    """Return the machines with their hooks: before the headers of Python, which define macros."""
    out = Emitter()
    for bound in module.bound.everyone:
        out.line(f'#include "{bound.names.prefix}.h"')
        print_hooks(out, module, bound)
        if module.traced:
            out.lines(["#undef FSM_HOOKS", '#define FSM_HOOKS "fsm.h"'])
        out.lines([f'#include "{bound.names.prefix}.c"', ""])
    out.lines([f'#include "{module.bound.names.prefix}_info.c"', ""])
    return out.finish()


def python_part(module: Module) -> str:
    """Return the rest: the object, what it calls, its methods, the module."""
    outer = module.bound
    out = Emitter()
    out.lines(['#include "fsm_python.h"', ""])
    out.lines(f"#undef {name}" for name in _like_macros(module))
    out.lines(fill(module, outer, OBJECT))
    out.line()
    _places(out, module, outer)
    for bound in outer.everyone:
        print_hook_functions(out, module, bound)
        print_host(out, module, bound)
    _events(out, module)
    _steps(out, module)
    methods = [*_fixed(module), *_of_events(out, module)]
    _variables(out, module)
    _tables(out, module, methods)
    return out.finish()


def _like_macros(module: Module) -> list[str]:
    """Return the names of members that could be macros of a system's headers."""
    found: set[str] = set()
    for bound in module.bound.everyone:
        names = bound.names
        found |= {*names.variables.values(), *names.payloads, *names.fields.values(), *names.slots}
    return sorted(
        name for name in found
        if name in MACROS or name.startswith(FAMILIES) or name != name.lower()
    )  # fmt: skip


def _places(out: Emitter, module: Module, bound: Bound) -> None:
    """Print how a machine in a slot finds the object it lies in, the outer ones first."""
    names = bound.names
    for inside, slot in zip(bound.invoked, names.slots, strict=True):
        out.lines(fill(module, inside, WITHIN, HOLDER=names.prefix, SLOT=slot))
        out.line()
        _places(out, module, inside)


def _events(out: Emitter, module: Module) -> None:
    """Print what Python and messages call the fields of events."""
    w = module.wrapper
    for event in module.chart.events:
        shown = fields_of(event.fields)
        if shown:
            _texts(out, f"{w}_fields_{event.index}", list(shown))
            said = [event.name + ": " + name for name in shown]
            _texts(out, f"{w}_said_{event.index}", said)
    with out.block(f"static const fsm_py_event {w}_events[] = {{", "};"):
        for event in module.chart.events:
            names = f"{w}_fields_{event.index}, {w}_said_{event.index}"
            out.line(f"{{{names}}}," if event.fields else "{NULL, NULL},")
        if not module.chart.events:
            out.line("{NULL, NULL},")
    out.line()


def _leaves(module: Module) -> str:
    return str(max(1, sum(state.is_leaf for state in module.chart.states)))


def _steps(out: Emitter, module: Module) -> None:
    names = module.bound.names
    parts = {"RUNNING": names.running, "NAME": quoted(module.chart.name)}
    parts |= {"UPPER": names.upper, "LEAVES": _leaves(module)}
    out.lines(fill(module, module.bound, METHODS, **parts))
    out.line()
    if module.saved:
        out.lines(fill(module, module.bound, SAVED_METHODS, **parts))
        out.line()


def _fixed(module: Module) -> list[Method]:
    """Return the methods that every machine has."""
    w = module.wrapper
    methods = [
        (name, f"{CAST if 'FASTCALL' in flags else ''}{w}_{name}", flags, documented(name, *rest))
        for name, flags, *rest in FIXED
    ]
    if module.saved:
        methods += [
            ("save", f"{CAST}{w}_save", KEYWORDS, documented("save", "now=None", SAVE)),
            (
                "restore",
                f"{CAST}{w}_restore",
                KEYWORDS,
                documented("restore", "saved, now=0", BACK),
            ),
        ]
    if module.traced:
        methods.append(("_dump", f"{w}_dump", "METH_NOARGS", "Tell the trace all data."))
    return methods


@telling
def documented(name: str, passed: str, doc: str) -> str:
    """Return a documentation in front of which stands the signature, as Python reads it."""
    return f"{name}({', '.join(filter(None, ('$self', passed)))})\n--\n\n{doc}"


def _of_events(out: Emitter, module: Module) -> list[Method]:
    """Print `post_` and `dispatch_` of each event; return them."""
    methods: list[Method] = []
    for event in posted(module.chart):
        name = module.bound.member.names.events[event.index]
        shown = fields_of(event.fields)
        told = "`" + event.name + "`"
        put = "Put " + told + " into the queue; False if that is full or the machine does not run."
        take = "Process " + told + " at once; whether it enabled a transition."
        for verb, doc in (("post", put), ("dispatch", take)):
            method, function = f"{verb}_{name}", f"{module.wrapper}_{verb}_{event.index}"
            _event_method(out, module, event, method, function)
            cast, flags = (CAST, KEYWORDS) if shown else ("", "METH_NOARGS")
            documentation = documented(method, ", ".join(shown), doc)
            methods.append((method, f"{cast}{function}", flags, documentation))
    return methods


def _event_method(out: Emitter, module: Module, event: Event, method: str, function: str) -> None:
    names, w = module.bound.names, module.wrapper
    is_put = method.startswith("post_")
    rest = "" if is_put else f", {event.index}"
    call = f"{w}_{'put' if is_put else 'take'}(({w}_object *)object, &e{rest})"
    if not event.fields:
        out.line(f"static PyObject *{function}(PyObject *object, PyObject *unused)")
        with out.block("{"):
            out.line(f"{names.prefix}_event e = {names.upper}_NO_EVENT;")
            out.line("(void)unused;")
            out.line(f"e.event = {names.events[event.index]};")
            out.line(f"return {call};")
        out.line()
        return
    count = len(event.fields)
    fields = f"{w}_fields_{event.index}"
    out.line(f"static PyObject *{function}(")
    out.line("    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)")
    with out.block("{"):
        out.line(f"{names.prefix}_event e = {names.upper}_NO_EVENT;")
        out.line(f"PyObject *values[{count}];")
        text = quoted(method)
        out.line(
            f"if (!fsm_py_arguments({text}, {fields}, {count}, given, count, keywords, values)"
        )
        out.line(f"    || !fsm_py_all({text}, {fields}, {count}, values)")
        filled = f"(fsm_object *)object, &{names.prefix}_info, {w}_events, {event.index}"
        out.line(f"    || !fsm_py_fill({filled}, &e, values))")
        out.line("    return NULL;")
        out.line(f"return {call};")
    out.line()


def _variables(out: Emitter, module: Module) -> None:
    """Print how data, outputs and inputs are read and written, by their place in the table."""
    names = module.bound.member.names.variables
    shown = [names[variable.name] for variable in _variables_of(module.chart)]
    _texts(out, f"{module.wrapper}_variables", shown)
    out.lines(fill(module, module.bound, VARIABLES))
    out.line()


def _variables_of(chart: Chart) -> tuple[Data, ...]:
    """Return the variables in the order of the table of the machine."""
    return (*chart.data, *chart.outputs, *chart.inputs)


def _tables(out: Emitter, module: Module, methods: list[Method]) -> None:
    """Print the type and the module."""
    bound, chart, w = module.bound, module.chart, module.wrapper
    class_ = bound.member.names.machine
    with out.block(f"static PyMethodDef {w}_methods[] = {{", "};"):
        for name, function, flags, doc in methods:
            out.line(f"{{{quoted(name)}, {function}, {flags},")
            out.line(f" {quoted(doc)}}},")
        out.line("{NULL, NULL, 0, NULL},")
    out.line()
    own = [f"{w}_get_{name}" for name in ("running", "finished", "fault")]
    with out.block(f"static PyGetSetDef {w}_attributes[] = {{", "};"):
        for getter in own:
            out.line(f'{{"{getter.rpartition("_")[2]}", {getter}, NULL, NULL, NULL}},')
        for name in ("log", "reply", *(("trace",) if module.traced else ())):
            out.line(f'{{"{name}", fsm_py_get_{name}, fsm_py_set_{name}, NULL, NULL}},')
        for number, variable in enumerate(_variables_of(chart)):
            name = quoted(bound.member.names.variables[variable.name])
            out.line(f"{{{name}, {w}_get, {w}_set, NULL, (void *){number}}},")
        out.line("{NULL, NULL, NULL, NULL, NULL},")
    out.line()
    _texts(out, f"{w}_states", [state.id for state in chart.states])
    _texts(out, f"{w}_names", [event.name for event in chart.events])
    _texts(out, f"{w}_calls", [method.name for method in module.calls])
    places = ", ".join(str(chart.event_index[event.name]) for event in chart.events) or "0"
    out.lines([f"static const Py_ssize_t {w}_places[] = {{{places}}};", ""])
    _quote(out, f"{w}_python", definitions(module))
    doc = f"{class_}: create it, `start` it, `post` events, `run` it to a time."
    provides = "".join(
        f"    if (!fsm_py_provides(&self->o, provider, {quoted(each.chart.name)}, "
        f"{each.first_call}, {each.first_call + len(each.calls)}))\n        return -1;\n"
        for each in bound.everyone
        if each.calls
    )
    told = chart.doc or "The machine " + chart.name + "."
    parts = {"CLASS": class_, "NAME": quoted(chart.name), "MODULE": module.name}
    provides = provides.rstrip("\n") or "    (void)provider;"
    out.lines(fill(module, bound, MAKING, CHECKS=provides, **parts))
    out.line()
    slots = {
        "new": f"{w}_new", "init": f"{w}_init", "dealloc": "fsm_py_dealloc",
        "traverse": "fsm_py_traverse", "clear": "fsm_py_clear",
        "methods": f"{w}_methods", "getset": f"{w}_attributes",
    }  # fmt: skip
    with out.block(f"static PyType_Slot {w}_slots[] = {{", "};"):
        signature = quoted(f"{class_}(operations=None)\n--\n\n{doc}")
        out.line(f"{{Py_tp_doc, (void *)(uintptr_t){signature}}},")
        out.lines(f"{{Py_tp_{slot}, (void *){text}}}," for slot, text in slots.items())
        out.line("{0, NULL},")
    out.line()
    with out.block(f"static PyType_Spec {w}_type = {{", "};"):
        out.line(f"{quoted(f'{module.name}.{class_}')}, (int)sizeof({w}_object), 0,")
        kinds = ("DEFAULT", "BASETYPE", "HAVE_GC")
        out.line(f"{' | '.join(f'Py_TPFLAGS_{flag}' for flag in kinds)}, {w}_slots,")
    out.line()
    parts |= {
        "STATES": str(len(chart.states)), "EVENTS": str(len(chart.events)),
        "SYMBOLS": str(len(bound.names.symbols)), "FIRST": str(bound.first_call),
        "CALLS": str(len(module.calls)), "DOC": quoted(told),
        "FILE": f"<{module.name}>",
    }  # fmt: skip
    out.lines(fill(module, bound, LOADING, **parts))


def _texts(out: Emitter, name: str, texts: list[str]) -> None:
    with out.block(f"static const char *const {name}[] = {{", "};"):
        out.lines(f"{quoted(text)}," for text in texts)
        if not texts:
            out.line("NULL,")
    out.line()


def _quote(out: Emitter, name: str, text: str) -> None:
    """Print a text of several lines as a constant."""
    out.line(f"static const char {name}[] =")
    lines = [quoted(f"{line}\n") for line in text.rstrip("\n").split("\n")]
    with out.indented():
        out.lines([*lines[:-1], f"{lines[-1]};"])
    out.line()
