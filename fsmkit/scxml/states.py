"""Reading of elements into states and transitions (SCXML 3.3 to 3.11, 5.5, 6.4)."""

from __future__ import annotations

from collections.abc import Callable

from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.document import keys
from fsmkit.document.literal_content import content_value
from fsmkit.language.statements.tree import DocArgument, Fail
from fsmkit.scxml.content import read_block, read_content, read_params
from fsmkit.scxml.context import Context, words
from fsmkit.scxml.fields import read_keys
from fsmkit.scxml.names import (
    PREFIX,
    STATES,
    known_children,
)
from fsmkit.scxml.nodes import Element

KINDS = {kind.value: kind for kind in doc.Kind}
TIMED = {"after": doc.Trigger.AFTER, "every": doc.Trigger.EVERY}
ReadChart = Callable[[Element, Context], doc.Document]


class StateReader:
    """Reads states; errors go to the findings, and the rest is still read."""

    def __init__(self, context: Context, read_chart: ReadChart) -> None:
        """Read in a context; ``read_chart`` reads inline charts of an ``invoke``."""
        self._context = context
        self._read_chart = read_chart

    def state(self, word: str, element: Element) -> doc.DocState:
        """Read a state of any kind, or under ``fk:refine`` a change of one."""
        context = self._context
        name = word.removeprefix(f"{PREFIX}:")
        id_ = context.given(element, "state" if name == "refine" else "id")
        parts: dict[str, list[Element]] = {}
        children: list[doc.DocState] = []
        for child_word, child in context.children(element, known_children(name)):
            if child_word in STATES:
                children.append(self.state(child_word, child))
            else:
                parts.setdefault(child_word, []).append(child)
        kind = self._kind(name, element, has_children=bool(children))
        is_history = name == "history"
        transitions = tuple(self._transition(e) for e in parts.get("transition", ()))
        if is_history:
            default, transitions = self._default(parts.get("transition", [])), ()
        else:
            default = self.initial(element, parts.get("initial", []))
        for used in parts.get("fk:use", ()):
            default = self.initial(used, []) or default
        index_range = context.fk(element, "for")
        done, done_content = self._done(parts.get("donedata", []))
        return doc.DocState(
            id=id_,
            kind=kind,
            span=element.span if id_ is None else id_.span,
            initial=default,
            children=tuple(children),
            transitions=transitions,
            invokes=tuple(self._invoke(e) for e in parts.get("invoke", ())),
            done_data=done,
            done_content=done_content,
            use=self._use(parts.get("fk:use", [])),
            index_range=None if index_range is None else index_range.strip(),
            doc=read_doc(element, parts.get("fk:doc", []), context),
            **read_keys(element, keys.STATE, context, parts),
        )

    def _kind(self, name: str, element: Element, *, has_children: bool) -> doc.Kind:
        context = self._context
        given = context.fk(element, "kind")
        if given is not None:
            if given.value in KINDS:
                return KINDS[given.value]
            known = ", ".join(KINDS)
            message = f"there is no kind of state `{given}`"
            context.misread(given, message, f"use one of {known}", KINDS)
        match name:
            case "parallel":
                return doc.Kind.PARALLEL
            case "final":
                return doc.Kind.FINAL
            case "history":
                type_ = context.given(element, "type")
                is_deep = type_ is not None and type_.value.lower() == "deep"
                if type_ is not None and type_.value not in ("shallow", "deep"):
                    context.misread(
                        type_,
                        f"a history is not `{type_}`; it is read as "
                        + ("deep" if is_deep else "shallow"),
                        "use shallow or deep",
                        ("shallow", "deep"),
                    )
                return doc.Kind.DEEP_HISTORY if is_deep else doc.Kind.SHALLOW_HISTORY
            case _:
                return doc.Kind.COMPOUND if has_children else doc.Kind.ATOMIC

    # --- transitions ----------------------------------------------------------------------

    def initial(self, element: Element, elements: list[Element]) -> doc.DocTransition | None:
        """Read the ``initial`` attribute, or the ``initial`` element (SCXML 3.6)."""
        context = self._context
        attribute = context.given(element, "initial")
        if attribute is not None:
            if elements:
                at = elements[0].span
                context.conflict(at, "`initial` is given twice; the attribute counts")
            return doc.DocTransition(doc.Trigger.INITIAL, attribute.span, targets=words(attribute))
        if not elements:
            return None
        inner = [e for _, e in context.children(elements[0], ("transition",))]
        if not inner:
            context.incomplete(elements[0], "has no `<transition>`", "add one with a `target`")
            return None
        return self._default(inner)

    def _default(self, elements: list[Element]) -> doc.DocTransition | None:
        """Read the transition of an ``initial`` or ``history``, with neither event nor guard."""
        if not elements:
            return None
        element, *more = elements
        for other in more:
            self._context.conflict(other.span, "only the first `<transition>` counts here")
        for name in ("event", "cond", "type"):
            if (value := element.get(name)) is not None:
                self._context.misread(value, f"`{name}` has no meaning here", "remove it")
        return doc.DocTransition(
            doc.Trigger.INITIAL,
            element.span,
            targets=words(element.get("target")),
            content=read_block(element, self._context) if element.children else None,
        )

    def _transition(self, element: Element) -> doc.DocTransition:
        trigger, delay = self._trigger(element)
        return doc.DocTransition(
            trigger,
            element.span,
            words(element.get("event")),
            delay,
            content=read_block(element, self._context) if element.children else None,
            **read_keys(element, keys.TRANSITION, self._context),
        )

    def _trigger(self, element: Element) -> tuple[doc.Trigger, Text | None]:
        context = self._context
        found: list[tuple[doc.Trigger, Text | None, Text]] = []
        if words(event := element.get("event")) and event is not None:
            found.append((doc.Trigger.EVENT, None, event))
        for name, trigger in TIMED.items():
            if (delay := context.fk(element, name)) is not None:
                found.append((trigger, delay.strip(), delay))
        sometimes = context.fk(element, "sometimes")
        if sometimes is not None and context.flag(sometimes, "sometimes"):
            found.append((doc.Trigger.SOMETIMES, None, sometimes))
        for _, _, at in found[1:]:
            context.findings.add(
                "conflicting-triggers",
                "a transition has one trigger: an event, `after`, `every` or `sometimes`",
                at,
                help="write a transition for each",
            )
        return found[0][:2] if found else (doc.Trigger.EVENTLESS, None)

    # --- used charts ----------------------------------------------------------------------

    def _use(self, elements: list[Element]) -> doc.DocUse | None:
        """Read the chart that fills a state, and its bindings."""
        context = self._context
        if not elements:
            return None
        for other in elements[1:]:
            context.conflict(other.span, "only the first `<fk:use>` counts")
        element = elements[0]
        parts: dict[str, list[Element]] = {}
        for word, child in context.children(element, known_children("use")):
            parts.setdefault(word, []).append(child)
        exits: dict[str, list[tuple[Text, doc.DocTransition]]] = {}
        for child in parts.get("fk:exit", ()):
            name = context.required(child, "name")
            if name is not None:
                exits.setdefault(name.value, []).append((name, self._exit(child)))
        return doc.DocUse(
            element.span,
            constants=self._pairs(parts.get("fk:with", []), "expr"),
            start=self._pairs(parts.get("fk:start", []), "expr"),
            bind=self._pairs(parts.get("fk:bind", []), "to"),
            exits=tuple(
                doc.DocExit(given[0][0], tuple(transition for _, transition in given))
                for given in exits.values()
            ),
            **read_keys(element, keys.USE, context),
        )

    def _pairs(self, elements: list[Element], value: str) -> tuple[DocArgument, ...]:
        found = []
        for element in elements:
            name = self._context.required(element, "name")
            text = self._context.required(element, value)
            if name is not None and text is not None:
                found.append(DocArgument(name, text))
        return tuple(found)

    def _exit(self, element: Element) -> doc.DocTransition:
        return doc.DocTransition(
            doc.Trigger.EVENTLESS,
            element.span,
            content=read_block(element, self._context) if element.children else None,
            **read_keys(element, keys.EXIT, self._context),
        )

    # --- data, done data, invoked charts --------------------------------------------------

    def _done(self, elements: list[Element]) -> tuple[tuple[DocArgument, ...], Text | None]:
        context = self._context
        if not elements:
            return (), None
        for other in elements[1:]:
            context.conflict(other.span, "only the first `<donedata>` counts")
        params = self._params(elements[0], ("content",))
        literal, expression = read_content(elements[0], context)
        if expression is None and literal is not None:
            expression = content_value(literal)
        return params, expression

    def _params(self, element: Element, others: tuple[str, ...]) -> tuple[DocArgument, ...]:
        params = read_params(element, self._context, others)
        if isinstance(params, Fail):
            self._context.complain("incomplete-element", params.reason, params.span, "add it")
            return ()
        return params

    def _invoke(self, element: Element) -> doc.DocInvoke:
        context = self._context
        chart: doc.Document | None = None
        parts: dict[str, list[Element]] = {}
        for child in element.children:
            parts.setdefault(context.word(child), []).append(child)
        for content in parts.get("content", ()):
            inner = [c for c in content.children if context.word(c) == "scxml"]
            chart = self._read_chart(inner[0], context) if inner else chart
        return doc.DocInvoke(
            element.span,
            arguments=self._params(element, ("content", "finalize")),
            content=chart,
            content_expr=read_content(element, context)[1],
            **read_keys(element, keys.INVOKE, context, parts),
        )


def read_doc(element: Element, elements: list[Element], context: Context) -> str:
    """Return the documentation of an element: the attribute ``fk:doc`` or elements of that name."""
    attribute = context.fk(element, "doc")
    texts = [] if attribute is None else [attribute.value]
    return "\n".join(t.strip() for t in (*texts, *(e.text.value for e in elements))).strip()
