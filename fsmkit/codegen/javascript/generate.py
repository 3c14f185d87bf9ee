"""A chart as a module of JavaScript. This file is the table of contents of the generated text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import assert_never

from fsmkit.chart.chart import (
    OPEN_ENDED,
    Chart,
    Event,
    Invocation,
    Passage,
    State,
    Transition,
    every_operation,
)
from fsmkit.chart.content import functions_called
from fsmkit.codegen.javascript.content import ContentPrinter, of_transition
from fsmkit.codegen.javascript.expressions import SAFE, Printer
from fsmkit.codegen.javascript.saving import image_lines
from fsmkit.document.document import Direction, Kind, Trigger
from fsmkit.emit import Emitter, Namer, legal, printing, snake
from fsmkit.emit.javascript import comment, member, quoted
from fsmkit.language import Expr, Field, default_value
from fsmkit.plan import Branch, Content, Enter, Op, Plan, Restore, Variant, lower
from fsmkit.plan.entries import entry_by_default
from fsmkit.plan.image import Image
from fsmkit.plan.operations import Action, Finish, IfFinal, RaiseDone
from fsmkit.runtime.library import JAVASCRIPT_LIBRARY

RUNTIME = "fsmkit_runtime.mjs"
TYPES = "fsmkit_runtime.d.mts"
SAVING = "fsmkit_saving.mjs"
GLOBALS = ("BigInt", "Infinity", "Map", "Math", "NaN", "Number", "Object", "Set", "Undefined")
"""The names that the module uses."""
SAVED = """

/** The machine as bytes, at a time in ticks, else at that of the last call. */
save(now) {
  return saving.save(this, now);
}

/** Go on from what was saved, at a time in ticks. */
restore(saved, now = 0) {
  saving.restore(this, saved, now);
}
"""


def library(*, saved: bool) -> dict[str, str]:
    """Return the files that all machines import, by name."""
    names = (RUNTIME, TYPES, SAVING) if saved else (RUNTIME, TYPES)
    return {name: (JAVASCRIPT_LIBRARY / name).read_text(encoding="utf-8") for name in names}


def file_name(chart: Chart, prefix: str | None = None) -> str:
    """Return the file name of the module: ``feeder.mjs``; never that of an imported file."""
    name = f"{snake(prefix or chart.name)}.mjs"
    return f"machine_{name}" if name in (RUNTIME, SAVING) else name


def class_name(chart: Chart, prefix: str | None = None) -> str:
    """Return the name of the class that the module exports."""
    name = legal(prefix or chart.name)
    return Namer(GLOBALS).name(name[:1].upper() + name[1:])


@printing
def module_text(
    chart: Chart, prefix: str | None = None, *, saved: bool = False, safe: int = SAFE
) -> str:
    """Return the text of the module. The same chart has the same text. ``prefix`` names the class.

    ``saved``: the machine can be saved and restored.
    """
    out = Emitter("  ")
    name = class_name(chart, prefix)
    source = Path(chart.sources[0].name).name if chart.sources else "a chart"
    out.line("// " + comment(chart.doc.strip() or chart.name))
    out.line("//")
    out.line(
        "// Made by fsmkit from "
        + comment(source)
        + f": change that, not this. Times are ticks of {chart.capacities.tick} us, modulo 2^32."
    )
    out.line()
    out.line(f'import * as rt from "./{RUNTIME}";')
    if saved:
        out.line(f'import * as saving from "./{SAVING}";')
    out.line()
    definition = ModulePrinter(out, safe, Namer(), saved).chart(chart)
    with out.block(f"export class {name} extends rt.Machine {{"):
        with out.block("constructor(host) {"):
            out.line(f"super({definition}, host);")
        if saved:
            out.text(SAVED)
    return out.finish()


@dataclass(frozen=True, slots=True)
class ModulePrinter:
    """Prints the definitions of charts, invoked charts before their invokers."""

    out: Emitter
    safe: int
    namer: Namer
    saved: bool

    def chart(self, chart: Chart) -> str:
        """Print the definition of a chart; return its name."""
        invoked = [self.chart(invocation.chart) for invocation in chart.invocations]
        name = self.namer.name("definition")
        with self.out.block(f"const {name} = (() => {{", "})();"):
            names = {f.name: f"fn{n}_{legal(f.name)}" for n, f in enumerate(chart.functions)}
            printer = Printer(every_operation(chart), self.safe, functions=names)
            ChartPrinter(lower(chart), self.out, printer, self.saved).print(invoked)
        self.out.line()
        return name


@dataclass(frozen=True, slots=True)
class ChartPrinter:
    """Prints one chart: a function for each block of code, and tables of these functions."""

    plan: Plan
    out: Emitter
    printer: Printer
    saved: bool

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    @property
    def content(self) -> ContentPrinter:
        """The printer of content outside of transitions."""
        return ContentPrinter(self.chart, self.out, self.printer)

    def print(self, invoked: list[str]) -> None:
        """Print the definition; ``invoked``: the names of the invoked charts' definitions."""
        chart, out = self.chart, self.out
        called = functions_called(chart)
        for function in chart.functions:
            if function.name in called:
                self.content.function(function)
        states = [self._state(state) for state in chart.states]
        transitions = [self._transition(transition) for transition in chart.transitions]
        events = [self._event(event) for event in chart.events]
        self._function("reset", self._reset)
        self._function("inputs", lambda: self._values("inputs", chart.inputs))
        root = chart.transitions[chart.root.initial or 0]
        script = self._block("script", self.content, chart.script)
        initial = self._block("initial", self.content, root.content)
        self._function("enter", lambda: self._ops(self.plan.start, {}))
        conclude = self._conclude()
        capacities = chart.capacities
        with out.block("return {", "};"):
            out.line(f"name: {quoted(chart.name)},")
            out.line(f"operations: [{_list(quoted(o) for o in every_operation(chart))}],")
            self._table("states", states)
            self._table("transitions", transitions)
            self._table("events", events)
            postable = [
                f"[{quoted(event.name)}, {event.index}]"
                for event in sorted(chart.events, key=lambda e: chart.event_index[e.name])
                if Direction.IN in event.directions and event.invocation is None
            ]
            out.line(f"postable: new Map([{_list(postable)}]),")
            errors = [
                f"[{quoted(name)}, {chart.event_index[name]}]"
                for name in ("error.communication", "error.execution", "error.range")
                if name in chart.event_index
            ]
            out.line(f"errors: new Map([{_list(errors)}]),")
            pairs = zip(chart.invocations, invoked, strict=True)
            self._table("invocations", [self._invocation(one, name) for one, name in pairs])
            out.line(f"samplesInputs: {_bool(self.plan.features.samples_inputs)},")
            out.line(f"queue: {capacities.queue},")
            out.line(f"internal: {capacities.internal},")
            out.line(f"delayed: {capacities.delayed},")
            out.line(f"microsteps: {capacities.microsteps},")
            out.line("reset,")
            out.line("inputs,")
            out.line(f"script: {script},")
            out.line(f"initial: {initial},")
            out.line("enter,")
            out.line(f"conclude: {conclude},")
            if self.saved:
                with out.block("image: {", "},"):
                    out.lines(image_lines(Image(self.plan), self.printer))

    # --- functions ------------------------------------------------------------------------------

    def _function(self, name: str, body: Callable[[], object]) -> str:
        with self.out.block(f"function {name}(m) {{"):
            body()
        self.out.line()
        return name

    def _block(self, name: str, content: ContentPrinter, block: tuple[object, ...]) -> str:
        if not block:
            return "null"
        return self._function(name, lambda: content.statements(block))  # type: ignore[arg-type]

    def _table(self, name: str, rows: Iterable[str]) -> None:
        with self.out.block(f"{name}: [", "],"):
            self.out.lines(f"{row}," for row in rows)

    def _reset(self) -> None:
        self._values("data", self.chart.data)
        self._values("outputs", self.chart.outputs)

    def _values(self, place: str, variables: Iterable[object]) -> None:
        for variable in variables:
            text = self.printer.spell(variable.init.value, variable.type)  # type: ignore[attr-defined]
            self.out.line(f"m.{place}{member(variable.name)} = {text};")  # type: ignore[attr-defined]

    # --- states ---------------------------------------------------------------------------------

    def _state(self, state: State) -> str:
        chart, plan, index = self.chart, self.plan, state.index
        stem = f"{index}_{legal(state.id)}"
        own = [chart.transitions[t] for t in state.transitions]
        on: dict[int, list[int]] = {}
        for transition in own:
            if transition.trigger is Trigger.EVENT:
                for event in transition.events:
                    on.setdefault(event, []).append(transition.index)
        handlers = {
            kind: [
                self._block(f"{kind}_{stem}_{place}", self.content, block)
                for place, block in enumerate(blocks)
                if block
            ]
            for kind, blocks in (
                ("entry", state.on_entry),
                ("exit", state.on_exit),
                ("invoke", state.invokes),
            )
        }
        final = "null"
        if state.kind is Kind.FINAL:
            final = self._function(f"final_{stem}", lambda: self._final(plan.entering[index]))
        parts = {
            "id": quoted(state.id),
            "kind": quoted(state.kind.value),
            "parent": str(plan.parents[index] if index else -1),
            "last": str(plan.ends[index]),
            "isLeaf": _bool(state.is_leaf),
            "isDeep": _bool(state.kind is Kind.DEEP_HISTORY),
            "children": _numbers(plan.substates[index]),
            "histories": _numbers(plan.histories[index]),
            "forgotten": _numbers(plan.forgotten[index]),
            "on": f"new Map([{_list(f'[{e}, {_numbers(ts)}]' for e, ts in on.items())}])",
            "eventless": _numbers(t.index for t in own if t.trigger is Trigger.EVENTLESS),
            "timed": _numbers(t.index for t in own if t.has_timer),
            "defers": f"new Set({_numbers(state.defer)})",
            "shared": f"new Set({_numbers(sorted(plan.shared_deferral[index]))})",
            "entry": f"[{_list(handlers['entry'])}]",
            "exit": f"[{_list(handlers['exit'])}]",
            "invokes": f"[{_list(handlers['invoke'])}]",
            "slots": _numbers(i.index for i in chart.invocations if i.state == index),
            "final": final,
        }
        return _object(parts)

    def _final(self, actions: Iterable[Action]) -> None:
        """Print the additional effects of entering a final state (Appendix D, enterStates)."""
        for action in actions:
            match action:
                case Finish():
                    self.out.line("m._finish();")
                case RaiseDone(event, data):
                    self.out.line(f"m._enqueueInternal({event}, {self._done(event, data)});")
                case IfFinal(state, _, done):
                    with self.out.block(f"if (m._isInFinalState({state})) {{"):
                        self._final([done])
                case _:
                    pass  # the runtime does it for every state

    def _done(self, event: int, data: tuple[Expr, ...]) -> str:
        """Return the done event of a final state with its data (SCXML 5.5)."""
        texts = []
        for place, part in enumerate(self.chart.events[event].fields):
            text = self.printer.spell(default_value(part.type), part.type)
            if place < len(data):
                value = self.printer.print(data[place], part.type)
                text = f"m._attempt(() => {value}, {text})"
            texts.append(text)
        return f"[{_list(texts)}]"

    def _conclude(self) -> str:
        event = self.chart.done
        if event is None:
            return "null"

        def body() -> None:
            for final in self.plan.endings:
                text = self._done(event, self.chart.states[final].done_data)
                self.out.line(f"if (m._active[{final}]) m._answer({event}, {text});")

        return self._function("conclude", body)

    # --- transitions ----------------------------------------------------------------------------

    def _transition(self, transition: Transition) -> str:
        index = transition.index
        stem = f"{index}_{legal(self.chart.states[transition.source].id)}"
        guard = "null"
        if transition.guard is not None:
            text = of_transition(self.chart, self.printer, transition).print(transition.guard)
            guard = self._function(f"guard_{stem}", lambda: self.out.line(f"return {text};"))
        content = self._block(
            f"do_{stem}", self.content.for_transition(transition), transition.content
        )
        variants = []
        if transition.trigger is not Trigger.INITIAL:
            for place, variant in enumerate(self.plan.variants[index]):
                enter = "null"
                if variant.entry:
                    name, entry = f"enter_{stem}_{place}", variant.entry
                    enter = self._function(name, lambda entry=entry: self._ops(entry, {}))  # type: ignore[misc]
                variants.append(self._variant(variant, enter))
        parts = {
            "source": str(transition.source),
            "delay": str(transition.delay),
            **({} if transition.least is None else {"least": str(transition.least)}),
            **({"slack": str(OPEN_ENDED)} if transition.is_open_ended else {}),
            "isPeriodic": _bool(transition.trigger is Trigger.EVERY),
            **self._others(transition),
            "guard": guard,
            "content": content,
            "variants": f"[{_list(variants)}]",
        }
        return _object(parts)

    def _others(self, transition: Transition) -> dict[str, str]:
        """Return the other transitions that share the timer of this one."""
        waiting = self.chart.alternatives[transition.index] if transition.has_timer else ()
        return {"others": _numbers(t.index for t in waiting[1:])} if waiting[1:] else {}

    def _variant(self, variant: Variant, enter: str) -> str:
        conditions = []
        for one in variant.conditions:
            inside = self.plan.numbers_within(one.region, one.first, one.last)
            last = max((self.plan.ends[state] for state in inside), default=0)
            conditions.append(
                _object({"history": str(one.history), "first": str(one.first), "last": str(last)})
            )
        domain = "null" if variant.domain is None else str(variant.domain)
        return _object({"conditions": f"[{_list(conditions)}]", "domain": domain, "enter": enter})

    def _ops(self, ops: tuple[Op, ...], held: Mapping[int, str]) -> None:
        """Print operations of the Plan; ``held``: the variables with the records of histories."""
        out = self.out
        for op in ops:
            match op:
                case Enter(state, defaults):
                    more = f", {_numbers(defaults)}" if defaults else ""
                    out.line(f"m._enter({state}{more});")
                case Branch(history, recorded, unrecorded):
                    # kept, as entering its parent may make it forget
                    name = f"held{history}"
                    with out.block("{"):
                        out.line(f"const {name} = m._history.get({history});")
                        with out.block(f"if ({name} !== undefined) {{"):
                            self._ops(recorded, {**held, history: name})
                        with out.block("else {"):
                            self._ops(unrecorded, held)
                case Restore(history, below):
                    name = held.get(history, f"m._history.get({history})")
                    self._restore(history, name, below)
                case Content(transition):
                    out.line(f'm._tell(["t", {transition}]);')
                    out.line(f"m._block(m.definition.transitions[{transition}].content);")
                case _:
                    assert_never(op)

    def _restore(self, history: int, held: str, below: int) -> None:
        chart = self.chart
        if chart.states[history].kind is Kind.DEEP_HISTORY:
            self.out.line(f"m._restore({held}, {below});")
            return
        for child in self.plan.substates[below]:
            with self.out.block(f"if ({held}.includes({child})) {{"):
                self._ops(entry_by_default(chart, child), {})

    # --- events and invocations -----------------------------------------------------------------

    def _event(self, event: Event) -> str:
        finalize, source = "null", "0"
        if event.invocation is not None:
            payload = {part.name: place for place, part in enumerate(event.fields)}
            printer = Printer(self.printer.operations, self.printer.safe, payload)
            content = ContentPrinter(self.chart, self.out, printer)
            finalize = self._block(f"finalize_{event.index}", content, event.finalize)
            source = str(self.chart.invocations[event.invocation].state)
        fields = [f"[{quoted(part.name)}, {n}]" for n, part in enumerate(event.fields)]
        blank = [self.printer.spell(default_value(part.type), part.type) for part in event.fields]
        is_error = event.name.startswith("error.") and not event.directions
        return _object(
            {
                "name": quoted(event.name),
                "type": quoted(event.type),
                "size": str(len(event.fields)),
                "fields": f"new Map([{_list(fields)}])",
                "blank": f"[{_list(blank)}]",
                "isError": _bool(is_error and not self.chart.lenient),
                "finalize": finalize,
                "source": source,
            }
        )

    def _invocation(self, invocation: Invocation, definition: str) -> str:
        events, inner = self.chart.events, invocation.chart.events
        passages = [
            self._passage(passage, events[index].fields, inner)
            for index, passage in enumerate(invocation.passages)
        ]
        returns = [
            self._passage(passage, inner[index].fields, events)
            for index, passage in enumerate(invocation.answers)
        ]
        return _object(
            {
                "id": quoted(invocation.id),
                "definition": definition,
                "forwards": _bool(invocation.autoforward),
                "passages": f"[{_list(passages)}]",
                "returns": f"[{_list(returns)}]",
            }
        )

    def _passage(
        self, passage: Passage | None, source: tuple[Field, ...], events: tuple[Event, ...]
    ) -> str:
        """Return the conversion of an event for another machine."""
        if passage is None:
            return "null"
        texts = []
        for part, place in zip(events[passage.event].fields, passage.fields, strict=True):
            if place is None:
                texts.append(self.printer.spell(default_value(part.type), part.type))
            else:
                texts.append(self.printer.moved(f"given[{place}]", source[place].type, part.type))
        return _object({"event": str(passage.event), "payload": f"(given) => [{_list(texts)}]"})


def _list(texts: Iterable[str]) -> str:
    return ", ".join(texts)


def _numbers(numbers: Iterable[int]) -> str:
    return f"[{_list(map(str, numbers))}]"


def _bool(value: object) -> str:
    return "true" if value else "false"


def _object(parts: Mapping[str, str]) -> str:
    return f"{{ {_list(f'{key}: {text}' for key, text in parts.items())} }}"
