"""``fk:property`` and ``fk:environment``: what shall hold of a chart, and what may come to it.

``<fk:property name="safe" never="In(moving) and blocked"/>``; of two conditions the second is
``then``, the time between them ``time``. Lists have commas between their items.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from lxml import etree

from fsmkit.diagnostics import Text, fail
from fsmkit.document import keys
from fsmkit.document.document import DocEnvironment, DocProperty
from fsmkit.document.lists import as_one, items_in
from fsmkit.scxml.context import Context
from fsmkit.scxml.markup import add, extension, put
from fsmkit.scxml.nodes import Element


def read_properties(elements: Iterable[Element], context: Context) -> Iterator[DocProperty]:
    """Yield what shall hold, as far as it can be read."""
    for element in elements:
        name = context.required(element, "name")
        kinds = [one for one in element.attributes if one.name in keys.PROPERTY]
        if name is None or not kinds:
            if name is not None:
                known = ", ".join(keys.PROPERTY)
                context.incomplete(element, "has no kind", f"give it one of {known}")
            continue
        kind, *others = kinds
        for other in others:
            context.conflict(other.span, f"`{kind.name}` and `{other.name}` are both given")
        yield DocProperty(
            name,
            Text(kind.name, kind.span),
            context.given(element, kind.name),
            context.given(element, "time"),
            context.given(element, "then"),
            _list(element, "watch", context),
        )


def read_environment(elements: Iterable[Element], context: Context) -> DocEnvironment | None:
    """Return what may come from outside; None where the chart does not say it."""
    found = list(elements)
    for again in found[1:]:
        context.conflict(again.span, "`<fk:environment>` is given twice; the first counts")
    if not found:
        return None
    may, will = (_list(found[0], key, context) for key in keys.OWN_ENVIRONMENT)
    return DocEnvironment(may, will, found[0].span)


def _list(element: Element, name: str, context: Context) -> tuple[Text, ...]:
    text = context.given(element, name)
    return () if text is None else tuple(item.strip() for item in items_in(text))


def add_properties(root: etree._Element, properties: Iterable[DocProperty]) -> None:
    """Append what shall hold."""
    for one in properties:
        element = add(root, extension("property"))
        put(element, "name", one.name)
        put(element, one.kind.value, "" if one.first is None else one.first)
        put(element, "time", one.time)
        put(element, "then", one.then)
        put(element, "watch", _joined(one.watch))


def add_environment(root: etree._Element, environment: DocEnvironment) -> None:
    """Append what may come from outside."""
    element = add(root, extension("environment"))
    put(element, "may", _joined(environment.may))
    put(element, "will", _joined(environment.will))


def _joined(items: tuple[Text, ...]) -> str | None:
    if not items:
        return None
    text = as_one(items)
    if text is None:
        raise fail(
            "not-expressible",
            "these items cannot be told apart with commas between them",
            items[0],
            help="close all parentheses, and leave no item empty",
        )
    return text
