"""The context of the reader: namespaces, common checks and findings."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fsmkit.diagnostics import Findings, Fix, Severity, Source, Span, Text
from fsmkit.diagnostics.fixes import Edit, remove_entry, replace_text
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.diagnostics.suggestions import find_synonym, suggest_key, suggest_name
from fsmkit.scxml.names import (
    ATTRIBUTES,
    EXTENSION,
    EXTENSION_ATTRIBUTES,
    EXTENSION_ELEMENTS,
    PREFIX,
    SCXML,
    STATES,
)
from fsmkit.scxml.nodes import Attribute, Element

WITH_TEXT = ("script", "content", "data", "assign", "fk:doc", "fk:function")
LARGEST_PART = 1024 * 1024
"""Bytes of a file that a chart includes by ``src``."""
WORD = re.compile(r"\S+")
FLAGS = {"true": True, "1": True, "false": False, "0": False}


OBJECT = re.compile(r"\{\s*\w+\s*:")
"""The start of an object whose members are named without quotes."""


@dataclass(frozen=True)
class Context:
    """Reads small parts of elements; errors go to the findings.

    A chart written for fsmkit is read strictly, any other leniently, with a warning for each
    ignored part.
    """

    source: Source
    findings: Findings
    namespace: str
    """The namespace of SCXML's elements in this file; other tools omit it."""
    datamodel: str = "ecmascript"
    is_foreign: bool = False
    """Whether the chart names an unknown data model."""

    @property
    def is_strict(self) -> bool:
        """Return whether the chart is written for fsmkit."""
        return self.datamodel == "fsmkit"

    # --- elements -------------------------------------------------------------------------

    def word(self, element: Element) -> str:
        """Return the name of an element: ``fk:name`` of the extension, empty if foreign."""
        if element.namespace in (SCXML, self.namespace):
            return element.name
        return f"{PREFIX}:{element.name}" if element.namespace == EXTENSION else ""

    def children(self, element: Element, known: Iterable[str]) -> Iterator[tuple[str, Element]]:
        """Yield the known children with their names; any other child of ours is a finding.

        Elements of other namespaces are ignored, as SCXML 1.0 requires (4.10, C).
        """
        names = tuple(known)
        for child in element.children:
            word = self.word(child)
            if word in names:
                self.check(child, word)
                yield word, child
            elif word:
                self.unknown_element(child, word, element, names)

    def unknown_element(
        self, child: Element, word: str, parent: Element, known: Iterable[str]
    ) -> None:
        """Report an element that has no meaning inside its parent."""
        is_known = word in ATTRIBUTES or word.removeprefix(f"{PREFIX}:") in EXTENSION_ELEMENTS
        advice = suggest_key(word, tuple(known), "remove it")
        if is_known:
            meant = find_synonym(word, known)
            advice = suggest_name(meant, word) if meant else f"move `<{word}>` to where it belongs"
        self.complain(
            "unknown-element",
            f"`<{word}>` has no meaning in `<{parent.name}>`",
            child.span,
            advice,
            is_ours=child.namespace == EXTENSION,
            fixes=remove_entry(child.span),
        )

    def check(self, element: Element, word: str) -> None:
        """Report attributes that mean nothing on an element, and text that nothing reads."""
        local = word.removeprefix(f"{PREFIX}:")
        is_ours = word != local
        plain = EXTENSION_ELEMENTS[local] if is_ours else ATTRIBUTES[local]
        own = frozenset() if is_ours else EXTENSION_ATTRIBUTES.get(local, frozenset())
        for attribute in element.attributes:
            known = {"": plain, EXTENSION: own}.get(attribute.namespace)
            if known is not None and attribute.name not in known:
                self.complain(
                    "unknown-attribute",
                    f"`<{word}>` has no attribute `{_written(attribute)}`",
                    attribute.span,
                    suggest_key(
                        _written(attribute),
                        tuple(sorted((*plain, *(f"{PREFIX}:{name}" for name in own)))),
                        _belongs(attribute.name, local),
                    ),
                    is_ours=is_ours or attribute.namespace == EXTENSION,
                    fixes=remove_entry(
                        Span(attribute.span.source, attribute.span.start + 1, attribute.span.end)
                    ),
                )
        if word not in WITH_TEXT and element.text.value.strip():
            self.complain(
                "stray-text",
                f"text in `<{word}>` has no meaning",
                element.text.strip(),
                "put it into a comment, or into an element that reads it",
                fixes=_commented(element.text.strip()),
            )

    def complain(
        self,
        rule: str,
        message: str,
        at: Span | Text,
        advice: str,
        *,
        is_ours: bool = False,
        fixes: Iterable[Fix] = (),
    ) -> None:
        """Add a finding: an error in a chart written for fsmkit, otherwise a warning."""
        severity = Severity.ERROR if is_ours or self.is_strict else None
        self.findings.add(rule, message, at, help=advice, severity=severity, fixes=fixes)

    # --- attributes -----------------------------------------------------------------------

    def fk(self, element: Element, name: str) -> Text | None:
        """Return an attribute of the extension, which on our own elements has no prefix."""
        return element.get(name, "" if element.namespace == EXTENSION else EXTENSION)

    def required(self, element: Element, name: str) -> Text | None:
        """Return a required attribute; report a missing one."""
        value = element.get(name)
        if value is None or not value.value.strip():
            self.incomplete(element, f"has no `{name}`", f'add `{name}="..."`')
            return None
        return value.strip()

    def incomplete(self, element: Element, what: str, advice: str) -> None:
        """Report a missing part of an element."""
        self.complain(
            "incomplete-element",
            f"`<{self.word(element)}>` {what}, and is ignored",
            element.span,
            advice,
            is_ours=element.namespace == EXTENSION,
        )

    def given(self, element: Element, name: str) -> Text | None:
        """Return an attribute without white space around it; None where it is empty."""
        value = element.get(name)
        return None if value is None or not value.value.strip() else value.strip()

    def either(self, element: Element, name: str, other: str) -> tuple[Text | None, Text | None]:
        """Return two attributes of which SCXML allows one; the first counts."""
        first, second = self.given(element, name), self.given(element, other)
        if first is not None and second is not None:
            self.conflict(second, f"`{name}` and `{other}` are both given; `{name}` counts")
            return first, None
        return first, second

    def conflict(self, at: Span | Text, message: str) -> None:
        """Report two parts that exclude each other."""
        fixes = remove_entry(at)
        self.complain("conflicting-attributes", message, at, "remove one of the two", fixes=fixes)

    def flag(self, value: Text | None, what: str) -> bool:
        """Read ``true`` or ``false``; absent is false."""
        if value is None:
            return False
        if value.value.strip() not in FLAGS:
            message = f"`{what}` is `true` or `false`, not `{value}`"
            self.misread(value, message, "write `true`", ("true", "false"))
        return FLAGS.get(value.value.strip(), False)

    def misread(
        self, value: Text, message: str, advice: str, instead_of: Iterable[str] = ()
    ) -> None:
        """Report an unknown value of an attribute; ``instead_of`` lists the valid ones."""
        fixes = [fix for word in instead_of for fix in replace_text(value, word)]
        self.complain("unexpected-attribute-value", message, value, advice, fixes=fixes)

    # --- texts ----------------------------------------------------------------------------

    def inline(self, element: Element) -> Text | None:
        """Return the value inside an element (SCXML B.2.1): JSON, or a string.

        Other data models write objects as in expressions: Promela ``{ a: 1 }``. Nested elements are
        a value, too, which no expression can equal: its text shows them.
        """
        if element.children:
            inner = element.inner
            return Text(inner.source.text[inner.start : inner.end], inner).strip()
        text = element.text.strip()
        if not text.value:
            return None
        return text if self.is_strict else self._json_or_string(text)

    def _json_or_string(self, text: Text) -> Text:
        if self.is_foreign and OBJECT.match(text.value):
            return text
        try:
            parse_json(text.value)
        except ValueError:
            return quoted(" ".join(text.value.split()), text.span)
        return text

    def load(self, src: Text) -> Text | None:
        """Return the content of a local file beside or below this one, None if it does not exist.

        The text has the location of the name, so errors in the file are reported there.
        """
        try:
            path = self.source.beside(src.value)
            if path is None or not path.is_file():
                return None
            if path.stat().st_size > LARGEST_PART:
                return None
            content = path.read_text(encoding="utf-8-sig")
        except (OSError, ValueError):
            return None
        return Text(content, src.span, ())

    def loaded_value(self, src: Text) -> Text | None:
        """Return the value in a file; report an unreadable file."""
        text = self.load(src)
        if text is None:
            self.unloaded(src, severity=None if self.is_strict else Severity.WARNING)
            return None
        value = Text(text.value.strip(), text.span, ())
        return value if self.is_strict else self._json_or_string(value)

    def unloaded(self, src: Text, severity: Severity | None = None) -> None:
        """Report an unreadable file."""
        self.findings.add(
            "unloaded-source",
            f"`{src}` cannot be read",
            src,
            help="name a file in the folder of the chart, or write its content here",
            severity=severity,
        )


def _commented(text: Text) -> tuple[Fix, ...]:
    """Return the fix that turns a text into a comment."""
    span = text.span
    written = span.source.text[span.start : span.end]
    if "--" in written or "<" in written:
        return ()
    return (Fix("Make it a comment", (Edit(span, f"<!-- {written} -->"),), is_sure=True),)


def words(text: Text | None) -> tuple[Text, ...]:
    """Split a text at white space, keeping the place of each word."""
    if text is None:
        return ()
    return tuple(text.part(m.start(), m.end()) for m in WORD.finditer(text.value))


def quoted(value: str, span: Span) -> Text:
    """Return a text as the literal of a string."""
    return Text(json.dumps(value, ensure_ascii=False), span, ())


def _written(attribute: Attribute) -> str:
    text = attribute.span.source.text
    return text[attribute.span.start : attribute.span.end]


def _belongs(name: str, element: str) -> str:
    """Return the name of an attribute as written."""
    if element in STATES and name in ("type", "parallel", "final"):
        return "the element says the kind of a state: `<parallel>`, `<final>`, `<history>`"
    owners = [f"`<{owner}>`" for owner, names in ATTRIBUTES.items() if name in names]
    return f"`{name}` belongs to {' or '.join(owners)}" if owners else "remove it"
