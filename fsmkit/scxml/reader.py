"""Reading of the root element into a Document: the chart and its declarations (SCXML 3.2, 5.2)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath

from fsmkit.diagnostics import Findings, Severity, Source, Span, Text
from fsmkit.diagnostics.fixes import add_attribute, replace_text
from fsmkit.document import document as doc
from fsmkit.document import keys
from fsmkit.language.statements.reading import read_body, read_signature
from fsmkit.language.statements.tree import Block, DocField, DocSignature, WrittenStatement
from fsmkit.scxml.content import script_block, script_text
from fsmkit.scxml.context import Context, words
from fsmkit.scxml.fields import read_keys
from fsmkit.scxml.functions import split_functions
from fsmkit.scxml.names import EXTENSION, SCXML, STATES, known_children
from fsmkit.scxml.nodes import Element, read_nodes
from fsmkit.scxml.properties import read_environment, read_properties
from fsmkit.scxml.states import StateReader, read_doc

DIRECTIONS = {direction.value: direction for direction in doc.Direction}


def read_document(source: Source, findings: Findings) -> doc.Document | None:
    """Return the document of an SCXML text, or None where an error was found."""
    document = read_as_far(source, findings)
    return None if findings.has_errors else document


def read_as_far(source: Source, findings: Findings) -> doc.Document | None:
    """Return the readable part of an SCXML text; None if it is not a chart."""
    root = read_nodes(source, findings)
    if root is None:
        return None
    if root.name != "scxml" or root.namespace == EXTENSION:
        findings.add(
            "not-scxml",
            f"`<{root.name}>` is not a chart",
            root.span,
            help="the outermost element of a chart is `<scxml>`",
        )
        return None
    context = Context(source, findings, root.namespace)
    if root.namespace != SCXML:
        what = f"`{root.namespace}` is not" if root.namespace else "there is no namespace:"
        findings.add(
            "missing-namespace",
            f"{what} the namespace of SCXML",
            root.span,
            help=f'write `xmlns="{SCXML}"`',
            fixes=() if root.namespace else add_attribute(root.span, "xmlns", SCXML, sure=True),
        )
    return _read_chart(root, context)


def _read_chart(root: Element, context: Context) -> doc.Document:
    """Return the chart of an ``scxml`` element, the outermost or one inside an ``invoke``."""
    datamodel = _datamodel(root, context)
    given = root.get("datamodel")
    is_foreign = given is not None and given.value.strip().lower() != datamodel
    return _ChartReader(
        root, replace(context, datamodel=datamodel, is_foreign=is_foreign)
    ).document()


def _datamodel(root: Element, context: Context) -> str:
    """Return the data model; an absent or unknown one is read as the subset of ECMAScript."""
    given = root.get("datamodel")
    name = "ecmascript" if given is None else given.value.strip().lower()
    if given is None or name in keys.CHART["datamodel"].choices:
        return name
    context.findings.add(
        "unknown-datamodel",
        f"the data model `{given}` is not known; expressions are read as ECMAScript's",
        given,
        help=f"use one of {', '.join(keys.CHART['datamodel'].choices)}",
        fixes=replace_text(given, "ecmascript"),
    )
    return "ecmascript"


class _ChartReader:
    """Reads the ``scxml`` element and the declarations in it."""

    def __init__(self, root: Element, context: Context) -> None:
        """Sort the children; report those that do not belong to a chart."""
        self._root = root
        self._context = context
        self._states = StateReader(context, _read_chart)
        self._parts: dict[str, list[Element]] = {}
        context.check(root, "scxml")
        for word, child in context.children(root, known_children("scxml")):
            self._parts.setdefault("state" if word in STATES else word, []).append(child)
        for datamodel in self._parts.get("datamodel", ()):
            for word, child in context.children(datamodel, known_children("datamodel")):
                if word != "data":
                    self._parts.setdefault(word, []).append(child)

    def document(self) -> doc.Document:
        """Return the document as far as it can be read."""
        root, context, states = self._root, self._context, self._states
        self._check_version()
        script, functions = self._script()
        return doc.Document(
            source=context.source,
            name=context.given(root, "name") or self._stem(),
            root=doc.DocState(
                id=None,
                kind=doc.Kind.COMPOUND,
                span=root.span,
                initial=states.initial(root, self._parts.get("initial", [])),
                children=tuple(
                    states.state(context.word(e), e) for e in self._parts.get("state", ())
                ),
            ),
            datamodel=context.datamodel,
            doc=read_doc(root, self._parts.get("fk:doc", []), context),
            types=tuple(self._type(e) for e in self._parts.get("fk:type", ())),
            constants=self._constants(),
            operations=tuple(
                doc.DocOperation(
                    s.name, s.fields, s.result, **read_keys(e, keys.OPERATION, context)
                )
                for e, s in self._signatures("fk:operation")
            ),
            functions=(
                *(
                    doc.DocFunction(s.name, s.fields, s.result, read_body(e.text, context.findings))
                    for e, s in self._signatures("fk:function")
                ),
                *functions,
            ),
            events=tuple(
                doc.DocEvent(s.name, s.fields, self._direction(e), s.result)
                for e, s in self._signatures("fk:event")
            ),
            capacities=self._capacities(),
            script=script,
            entries=self._entries(),
            properties=tuple(read_properties(self._parts.get("fk:property", ()), context)),
            environment=read_environment(self._parts.get("fk:environment", ()), context),
            refine=tuple(states.state("fk:refine", e) for e in self._parts.get("fk:refine", ())),
            **read_keys(root, keys.CHART, context, self._parts),
        )

    def _stem(self) -> Text:
        stem = PurePath(self._context.source.name).stem
        return Text(stem, Span(self._context.source, 0, 0))

    def _check_version(self) -> None:
        version = self._root.get("version")
        if version is None:
            self._context.findings.add(
                "missing-version",
                "the version of SCXML is missing",
                self._root.span,
                help='write `version="1.0"`',
                fixes=add_attribute(self._root.span, "version", "1.0", sure=True),
            )
        elif version.value.strip() != "1.0":
            message = f"there is no version `{version}`"
            self._context.misread(version, message, "write `1.0`", ("1.0",))

    def _script(self) -> tuple[Block, tuple[doc.DocFunction, ...]]:
        """Return the statements of the scripts, and the functions that they declare."""
        block: list[WrittenStatement] = []
        functions: list[doc.DocFunction] = []
        for script in self._parts.get("script", ()):
            text = script_text(script, self._context)
            if text is None:
                continue
            if not self._context.is_strict:
                text, found = split_functions(text)
                functions += found
            block += script_block(text, script, self._context)
        return tuple(block), tuple(functions)

    # --- declarations of the extension ----------------------------------------------------

    def _type(self, element: Element) -> doc.DocType:
        context = self._context
        name = context.required(element, "name") or Text("", element.span, ())
        fields = []
        for _, child in context.children(element, ("fk:field",)):
            field = context.required(child, "name")
            if field is not None:
                fields.append(DocField(field, context.required(child, "type")))
        members = tuple(map(doc.read_member, words(element.get("members"))))
        same = element.get("is")
        if same is not None and not same.value.strip():
            same = None
        if not members and not fields and same is None:
            advice = 'add `members="..."` or `is="0..100"`'
            context.incomplete(element, "has neither members nor fields", advice)
        if members and fields:
            context.conflict(members[0].name, "members and fields are both given; the fields count")
            members = ()
        if same is not None and (members or fields):
            context.conflict(same, "`is` is given beside members or fields; those count")
            same = None
        return doc.DocType(name, members, tuple(fields), None if same is None else same.strip())

    def _constants(self) -> tuple[doc.DocConstant, ...]:
        found = []
        for element in self._parts.get("fk:constant", ()):
            name = self._context.required(element, "name")
            value = self._context.required(element, "expr")
            if name is not None and value is not None:
                found.append(doc.DocConstant(name, value))
        return tuple(found)

    def _entries(self) -> tuple[doc.DocEntry, ...]:
        found = []
        for element in self._parts.get("fk:entry", ()):
            name = self._context.required(element, "name")
            targets = self._context.required(element, "target")
            if name is not None and targets is not None:
                found.append(doc.DocEntry(name, words(targets)))
        return tuple(found)

    def _signatures(self, word: str) -> list[tuple[Element, DocSignature]]:
        found = []
        for element in self._parts.get(word, ()):
            text = self._context.required(element, "signature")
            if text is None:
                continue
            is_loose = word == "fk:function" and not self._context.is_strict
            signature = read_signature(text, self._context.findings, is_loose=is_loose)
            if signature is not None:
                found.append((element, signature))
        return found

    def _direction(self, element: Element) -> doc.Direction:
        given = self._context.required(element, "direction")
        if given is not None and given.value not in DIRECTIONS:
            self._context.findings.add(
                "unexpected-attribute-value",
                f"an event does not go `{given}`",
                given,
                help=f"use {', '.join(DIRECTIONS)}",
                severity=Severity.ERROR,
                fixes=[fix for word in DIRECTIONS for fix in replace_text(given, word)],
            )
        return DIRECTIONS.get("" if given is None else given.value, doc.Direction.IN)

    def _capacities(self) -> tuple[doc.DocCapacity, ...]:
        return tuple(
            doc.DocCapacity(Text(attribute.name, attribute.span), attribute.value.strip())
            for element in self._parts.get("fk:capacity", ())
            for attribute in element.attributes
            if not attribute.namespace
        )
