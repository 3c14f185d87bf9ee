"""The source that joins a machine to the host's own C, and its header."""

from __future__ import annotations

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.binding.equality import equalities
from fsmkit.codegen.c.binding.values import HELPERS, Values
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.header import banner, parameters
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.existing_c.checks import CONTEXT, VALUE
from fsmkit.codegen.existing_c.model import Binding, Bound
from fsmkit.emit import Emitter, plain
from fsmkit.language import EnumType, Field, FloatType, RecordType, Type
from fsmkit.language.types import BoolType

MACHINE = "m"


def bound_sources(names: Names) -> dict[str, str]:
    """Return the source and its header by file name; none for a machine that is not bound."""
    binding = names.options.binding
    if binding is None:
        return {}
    printer = _Printer(names, binding)
    p = names.prefix
    return {f"{p}_bind.h": printer.header(), f"{p}_bind.c": printer.source()}


class _Printer:
    """Prints the source and its header."""

    def __init__(self, names: Names, binding: Binding) -> None:
        self.names = names
        self.binding = binding
        self.values = Values(names)
        self.uses_context = False

    def header(self) -> str:
        names, p = self.names, self.names.prefix
        out = Emitter()
        guard = f"{names.upper}_BIND_H"
        out.lines(banner(names, f"{p}_bind.h"))
        out.lines([f"#ifndef {guard}", f"#define {guard}", "", f'#include "{p}.h"', ""])
        out.lines(["#ifdef __cplusplus", 'extern "C" {', "#endif", ""])
        out.line("/* Read the bound inputs, each once. A value outside its range is taken as the")
        out.line(" * nearest bound, one that is no member or no number not at all. Returns how")
        counted = "; `rejected` counts them, too" if self._is_counted else ""
        out.line(f" * many were such{counted}. */")
        out.text(f"""
        uint16_t {p}_sample({p} *m);

        /* Write the bound outputs. */
        void {p}_apply({p} *m);

        /* A cycle: sample, run until now, apply. Returns what the first returns. */
        uint16_t {p}_cycle({p} *m, uint32_t now);
        """)
        out.lines(["", "#ifdef __cplusplus", "}", "#endif", "", "#endif"])
        return out.finish()

    def source(self) -> str:
        names, p = self.names, self.names.prefix
        body = Emitter()
        self._operations(body)
        self._sends(body)
        self._sample(body)
        self._apply(body)
        self._cycle(body)
        out = Emitter()
        out.lines(banner(names, f"{p}_bind.c"))
        out.line(f'#include "{p}_bind.h"')
        if self._embeds:
            out.lines(["", "#include <stddef.h>"])
        out.lines(["", *(f"#include {header}" for header in self.binding.includes)])
        checks = list(equalities(names))
        if checks:
            out.lines(["", "/* The chart says the value, the header the name: both are equal, or"])
            out.lines([" * one of these does not compile. */", *checks])
        out.line()
        for helper, text in HELPERS.items():
            if helper in self.values.used:
                out.text(text)
                out.line()
        if self.uses_context:
            self._context(out)
        out.lines(body.collected())
        return out.finish()

    @property
    def _is_counted(self) -> bool:
        return self.names.does.counted and self.names.does.queued

    @property
    def _embeds(self) -> bool:
        context = self.binding.context
        return self.uses_context and context is not None and bool(context.member)

    def _context(self, out: Emitter) -> None:
        p, context = self.names.prefix, self.binding.context
        assert context is not None  # noqa: S101  (checked with the binding)
        if context.expression is not None:
            with out.function(f"static {context.type} *fsm_bind_context({p} *m)"):
                if MACHINE not in context.expression.names:
                    out.line("(void)m;")
                out.line(f"return {context.expression.text};")
            return
        out.line(f"/* The {context.type} that the machine is embedded in. */")
        with out.function(f"static {context.type} *fsm_bind_context({p} *m)"):
            out.line("unsigned char *fsm_place = (unsigned char *)(void *)m;")
            out.line(f"fsm_place -= offsetof({context.type}, {context.member});")
            out.line(f"{context.type} *fsm_found = ({context.type} *)(void *)fsm_place;")
            out.line(f"{p} *fsm_same = &fsm_found->{context.member};")
            out.lines(["(void)fsm_same;", "return fsm_found;"])

    # --- calls ----------------------------------------------------------------------------------

    def _operations(self, out: Emitter) -> None:
        names, p = self.names, self.names.prefix
        for operation in names.chart.operations:
            bound = self.binding.operations.get(plain(operation.name))
            if bound is None:
                continue
            result = operation.result
            returned = "void" if result is None else parameter_type(result, names)
            given = parameters(operation.parameters, names)
            head = f"{returned} {p}_{names.operations[operation.name]}({p} *m{given})"
            with out.function(head):
                text = self._call(out, bound, operation.parameters, result)
                if result is None:
                    out.line(f"{text};")
                else:
                    self._return(out, bound, result, text)

    def _sends(self, out: Emitter) -> None:
        names, p = self.names, self.names.prefix
        for index in sent_events(names.chart):
            event = names.chart.events[index]
            bound = self.binding.sends.get(plain(event.name))
            if bound is None:
                continue
            head = (
                f"void {p}_send_{names.event_names[index]}({p} *m{parameters(event.fields, names)})"
            )
            with out.function(head):
                out.line(f"{self._call(out, bound, event.fields, None)};")

    def _call(
        self, out: Emitter, bound: Bound, fields: tuple[Field, ...], result: Type | None
    ) -> str:
        """Print the statements that a call's expression needs; return the expression."""
        used = bound.expression.names
        instead = {plain(field.name): self.names.field(field.name) for field in fields}
        counts = result is not None and not bound.is_trusted and not isinstance(result, BoolType)
        self._declare_context(out, used, set(instead), is_counting=counts and self._is_counted)
        for field in fields:
            name = plain(field.name)
            own = instead[name]
            if name not in used:
                out.line(f"(void){own};")
            elif isinstance(field.type, RecordType) and self.values.bound(field.type) is not None:
                instead[name] = f"fsm_{own}"
                self.values.converted(out, field.type, own, instead[name])
        if result is not None:
            return bound.expression.operand(instead)
        return bound.expression.replaced(instead)

    def _declare_context(
        self, out: Emitter, used: frozenset[str], own: set[str], *, is_counting: bool = False
    ) -> None:
        """Print the context, if an expression uses it, and that the machine may be unused."""
        used = used - own
        if CONTEXT in used:
            context = self.binding.context
            assert context is not None  # noqa: S101  (checked with the binding)
            self.uses_context = True
            out.line(f"{context.type} *const ctx = fsm_bind_context(m);")
        elif MACHINE not in used and not is_counting:
            out.line("(void)m;")

    def _return(self, out: Emitter, bound: Bound, result: Type, text: str) -> None:
        """Print the return statement for a result, within its range."""
        names = self.names
        if isinstance(result, BoolType):
            self.values.require_whole(out, text)
        if bound.is_trusted or isinstance(result, BoolType):
            out.line(f"return {text};")
            return
        rejected = "&m->fsm.rejected"
        if not self._is_counted:
            out.line("uint16_t fsm_rejected = 0u;")
            rejected = "&fsm_rejected"
        stored = storage(result, names.records).text
        if isinstance(result, EnumType | FloatType):
            start = "0.0f" if stored == "float" else "0.0"
            if isinstance(result, EnumType):
                start = f"({stored}){names.members[result.name][0]}"
            out.line(f"{stored} fsm_kept = {start};")
            self.values.take(out, result, text, "fsm_kept", rejected, trusted=False)
            out.line(f"return {self.values.given(result, 'fsm_kept')};")
        else:
            out.line(f"return {self.values.within(result, text, rejected)};")

    # --- variables ------------------------------------------------------------------------------

    def _sample(self, out: Emitter) -> None:
        names, p = self.names, self.names.prefix
        inputs = [(v, self.binding.inputs.get(plain(v.name))) for v in names.chart.inputs]
        bound = [(variable, each) for variable, each in inputs if each is not None]
        with out.function(f"uint16_t {p}_sample({p} *m)"):
            used = frozenset(name for _, each in bound for name in each.expression.names)
            out.line("uint16_t fsm_rejected = 0u;")
            self._declare_context(out, used | ({MACHINE} if bound else set()), set())
            for variable, each in bound:
                target = f"m->{names.variables[variable.name]}"
                text = each.expression.operand({})
                self.values.take(
                    out, variable.type, text, target, "&fsm_rejected", trusted=each.is_trusted
                )
            if bound and self._is_counted:
                with out.block("for (uint16_t fsm_n = 0u; fsm_n < fsm_rejected; fsm_n++) {"):
                    out.line("fsm_count(&m->fsm.rejected);")
            out.line("return fsm_rejected;")

    def _apply(self, out: Emitter) -> None:
        names, p = self.names, self.names.prefix
        outputs = [(v, self.binding.outputs.get(plain(v.name))) for v in names.chart.outputs]
        bound = [(variable, each) for variable, each in outputs if each is not None]
        with out.function(f"void {p}_apply({p} *m)"):
            used = frozenset(name for _, each in bound for name in each.expression.names)
            self._declare_context(out, used | ({MACHINE} if bound else set()), set())
            for variable, each in bound:
                stored = f"m->{names.variables[variable.name]}"
                if not each.is_setter:
                    self.values.give(out, variable.type, stored, each.expression.operand({}))
                    continue
                with out.block("{"):
                    if isinstance(variable.type, RecordType):
                        self.values.converted(out, variable.type, stored, VALUE)
                    else:
                        ctype = parameter_type(variable.type, names)
                        given = self.values.given(variable.type, stored)
                        out.line(f"const {ctype} {VALUE} = {given};")
                    out.line(f"{each.expression.text};")

    def _cycle(self, out: Emitter) -> None:
        p = self.names.prefix
        with out.function(f"uint16_t {p}_cycle({p} *m, uint32_t now)"):
            out.line(f"const uint16_t rejected = {p}_sample(m);")
            runs = self.names.does.runs
            out.line(f"{p}_run(m, now);" if runs else "(void)now; /* it moves when dispatched */")
            out.line(f"{p}_apply(m);")
            out.line("return rejected;")
