"""``fk:property`` and ``fk:environment``: properties of a chart, and its environment.

``<fk:property name="safe" never="In(moving) and blocked"/>``; a second condition is ``then``, the
time between them ``time``. Lists have commas between their items.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from lxml import etree

from fsmkit.diagnostics import Text, fail
from fsmkit.document import keys
from fsmkit.document.document import DocEnvironment, DocProperty
from fsmkit.document.lists import join_items, split_items
from fsmkit.scxml.context import Context, words
from fsmkit.scxml.markup import add, extension, joined, put
from fsmkit.scxml.nodes import Element


def read_properties(elements: Iterable[Element], context: Context) -> Iterator[DocProperty]:
    """Yield the readable properties."""
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
            req=words(element.get("req")),
        )


def read_environment(elements: Iterable[Element], context: Context) -> DocEnvironment | None:
    """Return the environment of a chart; None if the chart does not declare one."""
    found = list(elements)
    for again in found[1:]:
        context.conflict(again.span, "`<fk:environment>` is given twice; the first counts")
    if not found:
        return None
    may, will = (_list(found[0], key, context) for key in keys.OWN_ENVIRONMENT)
    return DocEnvironment(may, will, found[0].span)


def _list(element: Element, name: str, context: Context) -> tuple[Text, ...]:
    text = context.given(element, name)
    return () if text is None else tuple(item.strip() for item in split_items(text))


def add_properties(root: etree._Element, properties: Iterable[DocProperty]) -> None:
    """Append the properties."""
    for one in properties:
        element = add(root, extension("property"))
        put(element, "name", one.name)
        put(element, one.kind.value, "" if one.first is None else one.first)
        put(element, "time", one.time)
        put(element, "then", one.then)
        put(element, "watch", _joined(one.watch))
        put(element, "req", joined(one.req))


def add_environment(root: etree._Element, environment: DocEnvironment) -> None:
    """Append the environment."""
    element = add(root, extension("environment"))
    put(element, "may", _joined(environment.may))
    put(element, "will", _joined(environment.will))


def _joined(items: tuple[Text, ...]) -> str | None:
    if not items:
        return None
    text = join_items(items)
    if text is None:
        raise fail(
            "not-expressible",
            "these items cannot be separated by commas",
            items[0],
            help="close all parentheses, and leave no item empty",
        )
    return text
