"""Changes of a Document as changes of its SCXML file.

The old and the new Document are compared part by part. Parts are the same if they have the same
location, so moved and changed parts are recognized; what is equal is not touched.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from lxml import etree

from fsmkit.diagnostics import Source
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.keys import Key, Keys
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.editing.xml_tree import COMMENT, Tag, XmlTree
from fsmkit.language.statements.tree import Block
from fsmkit.scxml import writer
from fsmkit.scxml.markup import add, extension, joined
from fsmkit.scxml.names import EXTENSION, PREFIX, STATES
from fsmkit.scxml.properties import add_properties
from fsmkit.scxml.writing_content import add_content, add_params, add_script, add_statements

ROOT = (
    "fk:doc", "fk:type", "fk:constant", "fk:input", "fk:output", "fk:operation", "fk:function",
    "fk:event", "fk:capacity", "datamodel", "fk:entry", "fk:property", "fk:environment", "script",
    "initial", *STATES, "fk:refine",
)  # fmt: skip
"""The usual order of the children of a chart."""
STATE = (
    "fk:doc", "datamodel", "fk:use", "initial", "onentry", "onexit", "transition", "invoke",
    *STATES, "donedata",
)  # fmt: skip
"""The usual order of the children of a state."""
DECLARED = {
    "types": "fk:type", "constants": "fk:constant", "inputs": "fk:input", "outputs": "fk:output",
    "operations": "fk:operation", "functions": "fk:function", "events": "fk:event",
    "capacities": "fk:capacity", "data": "data", "entries": "fk:entry",
    "properties": "fk:property",
}  # fmt: skip
"""The elements of declarations, by the field of a Document."""


def edited_xml(source: Source, old: Document, new: Document, *, keeps_comments: bool) -> str:
    """Return the text of an SCXML chart after a change; see `edited_yaml`."""
    return XmlFile(source, old).changed(new, keeps_comments=keeps_comments)


def xml_remarks(source: Source) -> list[str]:
    """Return the comments of an XML source, in the order of the file."""
    return COMMENT.findall(source.text)


class XmlFile:
    """Changes an SCXML file from an old Document to a new one."""

    def __init__(self, source: Source, document: Document) -> None:
        """Locate the states and transitions of the document."""
        self.tree = XmlTree(source)
        self.old = self.new = document
        self.keeps_comments = True
        self.tags: dict[int, Tag] = {}
        self.known: dict[int, DocState] = {}
        self.carried: set[int] = set()
        root = self.tree.root
        self._locate(root, document.root)
        refined = [child for child in root.children if child.word == "fk:refine"]
        self._pair(refined, document.refine)

    def texts(self) -> Iterator[tuple[DocState, str]]:
        """Yield the states with their texts."""
        for key, state in self.known.items():
            tag = self.tags[key]
            if tag is not self.tree.root:
                yield state, self.tree.text[tag.start : tag.end]

    def _locate(self, tag: Tag, state: DocState) -> None:
        self.tags[id(state.span)] = tag
        self.known[id(state.span)] = state
        if state.kind not in HISTORIES:
            found = [child for child in tag.children if child.word == "transition"]
            if len(found) != len(state.transitions):
                raise rejected("the transitions cannot be located", help="edit the text")
            for child, one in zip(found, state.transitions, strict=True):
                self.tags[id(one.span)] = child
        self._pair([child for child in tag.children if child.word in STATES], state.children)

    def _pair(self, found: list[Tag], states: tuple[DocState, ...]) -> None:
        if len(found) != len(states):
            raise rejected("the states of the file cannot be located", help="edit the text")
        for child, state in zip(found, states, strict=True):
            self._locate(child, state)

    def changed(self, new: Document, *, keeps_comments: bool) -> str:
        """Return the text of the file for a new Document."""
        self.new, self.keeps_comments = new, keeps_comments
        tree, root = self.tree, self.tree.root
        if new.name.value != self.old.name.value:
            tree.set(root, "name", new.name.value)
        self._attributes(root, self.old, new, keys.CHART)
        self._doc(root, self.old.doc, new.doc, ROOT)
        self._declarations(root)
        if self.old.script != new.script:
            self._script(root)
        self._initial(root, self.old.root, new.root, ROOT)
        self._states(root, self.old.root.children, new.root.children, ROOT)
        self._states(root, self.old.refine, new.refine, ROOT, is_refined=True)
        return tree.written()

    # --- elements -----------------------------------------------------------------------------

    def _remove(self, parent: Tag, tag: Tag, *, moves: bool = False) -> None:
        """Remove a child; unless it moves, its comments move to the parent."""
        if any(tag is one for one in parent.children):
            parent.children = [one for one in parent.children if one is not tag]
        if self.keeps_comments and not moves:
            self._keep(parent, self.tree.remarks(tag))

    def _keep(self, parent: Tag, remarks: list[str]) -> None:
        if not remarks:
            return
        if parent is not self.tree.root:
            parent.above += remarks
        elif parent.children:
            parent.children[0].above += remarks
        else:
            raise rejected("a comment would be lost", help="edit the text")

    def _add(self, parent: Tag, tags: Iterable[Tag], order: tuple[str, ...]) -> None:
        """Add children at their usual position."""
        for tag in tags:
            ranks = {word: rank for rank, word in enumerate(order)}
            rank = ranks.get(tag.word, len(ranks))
            at = 0
            for number, one in enumerate(parent.children, 1):
                if ranks.get(one.word, -1) <= rank:
                    at = number
            parent.children.insert(at, tag)

    def _built(self, build: Callable[[etree._Element], object]) -> list[Tag]:
        """Return the elements that a writer builds."""
        parent = self.tree.fragment()
        build(parent)
        return self.tree.tags(parent)

    def _group(
        self,
        parent: Tag,
        found: list[Tag],
        build: Callable[[etree._Element, Any], object],
        old: tuple[Any, ...],
        new: tuple[Any, ...],
        order: tuple[str, ...],
        holder: Callable[[], Tag] | None = None,
    ) -> None:
        """Write a group of elements, one for each part, of which some changed."""
        before = [tag for one in old for tag in self._built(partial(_second, build, one))]
        after = [tag for one in new for tag in self._built(partial(_second, build, one))]
        if len(found) != len(before):
            if [t.new for t in after[: len(before)]] != [t.new for t in before]:
                raise rejected("the file declares it in another way", help="edit the text")
            self._add(holder() if holder else parent, after[len(before) :], order)
            return
        olds, news = [t.new for t in before], [t.new for t in after]
        previous: Tag | None = None
        matcher = difflib.SequenceMatcher(None, olds, news, autojunk=False)
        for what, first, last, begin, stop in matcher.get_opcodes():
            if what == "equal":
                previous = found[last - 1]
                continue
            for number, tag in enumerate(found[first:last]):
                owner = self._owner(parent, tag)
                if begin + number < stop:
                    built = after[begin + number]
                    built.lead = tag.lead
                    built.behind = tag.behind
                    owner.children[owner.children.index(tag)] = built
                    inner = [r for child in tag.children for r in self.tree.remarks(child)]
                    built.above = [*tag.above, *inner, *COMMENT.findall(tag.closing)]
                    previous = built
                else:
                    self._remove(owner, tag)
                    if owner is not parent and not owner.children:
                        self._remove(parent, owner)
            for built in after[begin + last - first : stop] if stop - begin > last - first else ():
                if previous is None:
                    self._before(parent, built, found, order, holder)
                else:
                    owner = self._owner(parent, previous)
                    owner.children.insert(owner.children.index(previous) + 1, built)
                previous = built

    def _before(
        self,
        parent: Tag,
        built: Tag,
        found: list[Tag],
        order: tuple[str, ...],
        holder: Callable[[], Tag] | None,
    ) -> None:
        here = [tag for tag in found if any(tag is c for c in self._owner(parent, tag).children)]
        if here:
            owner = self._owner(parent, here[0])
            owner.children.insert(owner.children.index(here[0]), built)
        else:
            self._add(holder() if holder else parent, [built], order)

    def _owner(self, parent: Tag, tag: Tag) -> Tag:
        """Return the element that contains a declaration: the parent, or a data model in it."""
        for one in parent.children:
            if one.word == "datamodel" and any(tag is child for child in one.children):
                return one
        return parent

    def _datamodel(self, parent: Tag, order: tuple[str, ...]) -> Callable[[], Tag]:
        def holder() -> Tag:
            found = next((c for c in parent.children if c.word == "datamodel"), None)
            if found is None:
                name = self.tree.element_name("datamodel")
                found = Tag("datamodel", new=f"<{name}>", name=name, is_open=True)
                self._add(parent, [found], order)
            return found

        return holder

    # --- keys ---------------------------------------------------------------------------------

    def _attributes(self, tag: Tag, old: Any, new: Any, rows: Keys) -> None:
        for row in rows.values():
            if row.form not in writer.ATTRIBUTE or row.scxml is None:
                continue
            if getattr(old, row.field) == getattr(new, row.field):
                continue
            self.tree.set(tag, row.scxml, _attribute(new, row))
        if isinstance(new, Document) and new.datamodel != old.datamodel:
            self.tree.set(tag, "datamodel", new.datamodel)

    def _doc(self, tag: Tag, old: str, new: str, order: tuple[str, ...]) -> None:
        if old == new:
            return
        found = [child for child in tag.children if child.word == "fk:doc"]
        if not found and tag.old is not None:
            given = tag.old.get("doc", "" if tag.word.startswith(f"{PREFIX}:") else EXTENSION)
            if given is not None:
                self.tree.set(tag, "fk:doc", new or None)
                return
        if len(found) > 1:
            raise rejected("the text has several descriptions", help="edit the text")
        built = self._built(lambda p: add(p, extension("doc"), new)) if new else []
        for one in found:
            at = tag.children.index(one)
            if built:
                built[0].lead, built[0].behind = one.lead, one.behind
                built[0].above = [*one.above, *COMMENT.findall(one.closing)]
                tag.children[at] = built[0]
                return
            self._remove(tag, one)
        self._add(tag, built, order)

    def _script(self, root: Tag) -> None:
        found = [child for child in root.children if child.word == "script"]
        if len(found) > 1:
            raise rejected("the chart has several scripts", help="edit the text")
        built = self._built(lambda p: add_script(p, self.new.script)) if self.new.script else []
        for one in found:
            self._remove(root, one)
        self._add(root, built, ROOT)

    def _declarations(self, root: Tag) -> None:
        for field, word in DECLARED.items():
            old, new = getattr(self.old, field), getattr(self.new, field)
            if old == new:
                continue
            inside = [c for d in root.children if d.word == "datamodel" for c in d.children]
            found = [child for child in (*root.children, *inside) if child.word == word]
            holder = self._datamodel(root, ROOT) if field == "data" else None
            self._group(root, found, _builder(field, self.new), old, new, ROOT, holder)

    # --- states -------------------------------------------------------------------------------

    def _states(
        self,
        parent: Tag,
        old: tuple[DocState, ...],
        new: tuple[DocState, ...],
        order: tuple[str, ...],
        *,
        is_refined: bool = False,
    ) -> None:
        if len(old) == len(new) and all(a is b for a, b in zip(old, new, strict=True)):
            return
        tags = [self._state(state, is_refined=is_refined) for state in new]
        kind = ("fk:refine",) if is_refined else STATES
        was = [child for child in parent.children if child.word in kind]
        self._arrange(parent, was, tags, order)

    def _arrange(
        self, parent: Tag, was: list[Tag], tags: list[Tag], order: tuple[str, ...]
    ) -> None:
        """Let children be these, in this order, without a move of the others."""
        gone = [tag for tag in was if not any(tag is one for one in tags)]
        for tag in gone:
            parent.children = [one for one in parent.children if one is not tag]
            if self.keeps_comments and not self._is_kept(tag):
                self._keep(parent, self._lost(tag))
        here = [tag for tag in tags if any(tag is one for one in was)]
        stays = [tag for tag in was if any(tag is one for one in here)]
        if stays != here:
            parent.children = [o for o in parent.children if not any(o is t for t in tags)]
            here = []
        previous: Tag | None = None
        for number, tag in enumerate(tags):
            if any(tag is one for one in here):
                previous = tag
                continue
            after = next((o for o in tags[number + 1 :] if any(o is h for h in here)), None)
            if previous is not None:
                parent.children.insert(parent.children.index(previous) + 1, tag)
            elif after is not None:
                parent.children.insert(parent.children.index(after), tag)
            else:
                self._add(parent, [tag], order)
            previous = tag

    def _is_kept(self, tag: Tag) -> bool:
        spans = {id(s.span) for s in _all(self.new)}
        spans |= {id(t.span) for s in _all(self.new) for t in s.transitions}
        return any(self.tags.get(span) is tag for span in spans)

    def _lost(self, tag: Tag) -> list[str]:
        """Return the comments of an element without those of parts that moved."""
        found = self.tree.own_remarks(tag)
        for child in tag.loaded:
            if not self._is_kept(child):
                found += self._lost(child)
        return found

    def _state(self, state: DocState, *, is_refined: bool = False) -> Tag:
        tag = self.tags.get(id(state.span))
        if tag is None:
            return self._new_state(state, is_refined=is_refined)
        old = self.known[id(state.span)]
        if old is not state:
            self._change(tag, old, state)
        return tag

    def _new_state(self, state: DocState, *, is_refined: bool) -> Tag:
        if is_refined:

            def build(parent: etree._Element) -> None:
                element = add(parent, extension("refine"))
                element.set("state", "" if state.id is None else state.id.value)

            return self._built(build)[0]
        if not any(id(one.span) in self.tags for one in _inside(state)):
            return self._built(lambda p: writer.add_state(p, state))[0]
        bare = replace(state, children=(), kind=Kind.ATOMIC)
        built = self._built(lambda p: writer.add_state(p, bare))[0]
        built.new = f"{built.new.removesuffix('/>')}>"
        built.name, built.is_open = self.tree.element_name("state"), True
        built.children = [self._state(child) for child in state.children]
        return built

    def _change(self, tag: Tag, old: DocState, new: DocState) -> None:
        tree = self.tree
        name = tag.word.removeprefix(f"{PREFIX}:")
        if old.id != new.id and new.id is not None:
            tree.set(tag, "state" if name == "refine" else "id", new.id.value)
        self._kind(tag, old, new)
        self._attributes(tag, old, new, keys.STATE)
        self._doc(tag, old.doc, new.doc, STATE)
        if old.data != new.data:
            models = [c for d in tag.children if d.word == "datamodel" for c in d.children]
            self._group(
                tag, models, _builder("data", self.new), old.data, new.data, STATE,
                self._datamodel(tag, STATE),
            )  # fmt: skip
        self._initial(tag, old, new, STATE)
        for key, word in (("entry", "onentry"), ("exit", "onexit")):
            before, after = getattr(old, key), getattr(new, key)
            if before != after:
                found = [child for child in tag.children if child.word == word]
                self._handlers(tag, word, found, before, after)
        if old.use != new.use:
            self._exits(tag, old, new)
        if not all(a is b for a, b in zip(old.transitions, new.transitions, strict=False)) or len(
            old.transitions
        ) != len(new.transitions):
            was = [child for child in tag.children if child.word == "transition"]
            before_by_span = {id(t.span): t for s in _all(self.old) for t in s.transitions}
            tags = [self._transition(before_by_span.get(id(t.span)), t) for t in new.transitions]
            self._arrange(tag, was, tags, STATE)
        if (old.done_data, old.done_content) != (new.done_data, new.done_content):
            self._done(tag, new)
        self._states(tag, old.children, new.children, STATE)

    def _kind(self, tag: Tag, old: DocState, new: DocState) -> None:
        tree = self.tree
        if tag.old is None or (old.kind is new.kind and bool(old.children) == bool(new.children)):
            return
        name = tag.word
        if name in STATES and old.kind is not new.kind:
            name = writer.TAGS.get(new.kind, "state")
            tag.name = tree.element_name(name)
        if name == "history":
            is_deep = new.kind is Kind.DEEP_HISTORY
            tree.set(tag, "type", "deep" if is_deep else "shallow")
        elif old.kind in HISTORIES:
            tree.set(tag, "type", None)
        implied = {"parallel": Kind.PARALLEL, "final": Kind.FINAL}.get(name)
        if name == "history":
            implied = new.kind
        elif implied is None:
            implied = Kind.COMPOUND if new.children else Kind.ATOMIC
        tree.set(tag, "fk:kind", None if implied is new.kind else new.kind.value)

    def _handlers(
        self, tag: Tag, word: str, found: list[Tag], before: tuple[Block, ...],
        after: tuple[Block, ...],
    ) -> None:  # fmt: skip
        def build(parent: etree._Element, block: Block) -> None:
            add_statements(add(parent, word), block)

        self._group(tag, found, build, before, after, STATE)

    def _initial(self, tag: Tag, old: DocState, new: DocState, order: tuple[str, ...]) -> None:
        """Write the initial transition of a state, or the default of a history."""
        if old.initial == new.initial:
            return
        tree = self.tree
        initial = new.initial
        used = next((child for child in tag.children if child.word == "fk:use"), None)
        element = next((child for child in tag.children if child.word == "initial"), None)
        word = joined(initial.targets) if initial is not None else None
        if old.kind in HISTORIES or new.kind in HISTORIES:
            found = next((child for child in tag.children if child.word == "transition"), None)
            if initial is None:
                if found is not None and old.kind in HISTORIES:
                    self._remove(tag, found)
            elif found is not None:
                tree.set(found, "target", word)
            else:
                self._add(tag, self._built(lambda p: writer.add_transition(p, initial)), order)
            return
        is_in_use = (
            used is not None and used.old is not None and used.old.get("initial") is not None
        )
        if initial is None:
            tree.set(tag, "initial", None)
            if used is not None:
                tree.set(used, "initial", None)
            if element is not None:
                self._remove(tag, element)
        elif element is not None and element.children:
            tree.set(element.children[0], "target", word)
        else:
            is_attribute = tag.word in ("state", "scxml") and not is_in_use and used is None
            if is_attribute or (tag.word == "fk:refine" and used is None):
                tree.set(tag, "initial", word)
            elif used is not None:
                tree.set(used, "initial", word)
            else:
                raise rejected("the element has no initial state", help="edit the text")

    def _exits(self, tag: Tag, old: DocState, new: DocState) -> None:
        """Write the exits of a used chart, of which some targets changed."""
        used = next((child for child in tag.children if child.word == "fk:use"), None)
        if used is None or old.use is None or new.use is None:
            raise rejected("the used chart of a state cannot change here", help="edit the text")
        if replace(old.use, exits=()) != replace(new.use, exits=()):
            raise rejected("the used chart of a state cannot change here", help="edit the text")
        kept = {t.span.start: t for e in new.use.exits for t in e.transitions}
        for child in [c for c in used.children if c.word == "fk:exit"]:
            one = kept.get(child.start)
            if one is None:
                self._remove(used, child)
            elif child.old is not None:
                targets = joined(one.targets)
                given = child.old.get("target")
                if given is None or given.value.split() != (targets or "").split():
                    tree_value = targets
                    self.tree.set(child, "target", tree_value)

    def _done(self, tag: Tag, new: DocState) -> None:
        for child in [c for c in tag.children if c.word == "donedata"]:
            self._remove(tag, child)

        def build(parent: etree._Element) -> None:
            done = add(parent, "donedata")
            add_params(done, new.done_data)
            add_content(done, None, new.done_content)

        if new.done_data or new.done_content is not None:
            self._add(tag, self._built(build), STATE)

    # --- transitions --------------------------------------------------------------------------

    def _transition(self, old: DocTransition | None, new: DocTransition) -> Tag:
        tag = self.tags.get(id(new.span))
        if tag is None or old is None:
            return self._built(lambda p: writer.add_transition(p, new))[0]
        if old is new:
            return tag
        tree = self.tree
        if (old.trigger, old.events, old.delay) != (new.trigger, new.events, new.delay):
            tree.set(tag, "event", joined(new.events))
            delay = None if new.delay is None else new.delay.value
            tree.set(tag, "fk:after", delay if new.trigger is Trigger.AFTER else None)
            tree.set(tag, "fk:every", delay if new.trigger is Trigger.EVERY else None)
            is_any = new.trigger is Trigger.SOMETIMES
            tree.set(tag, "fk:sometimes", "true" if is_any else None)
        self._attributes(tag, old, new, keys.TRANSITION)
        if old.content != new.content:
            for child in list(tag.children):
                self._remove(tag, child)
            self._keep(tag, COMMENT.findall(tag.closing))
            tag.closing = COMMENT.sub("", tag.closing)

            def build(parent: etree._Element) -> None:
                if new.content:
                    add_statements(parent, new.content)
                elif new.content is not None:
                    add(parent, "script")

            tag.children += self._built(build)
        return tag


def _attribute(part: Any, row: Key) -> str | None:
    if not row.is_given(part):
        return None
    value = writer.ATTRIBUTE[row.form](getattr(part, row.field), row)
    return None if value is None else str(value)


def _builder(field: str, document: Document) -> Callable[[etree._Element, Any], object]:
    """Return the writer of one declaration of a field."""

    def build(parent: etree._Element, one: Any) -> None:
        if field == "data":
            writer.add_variables(parent, "data", extension("type"), (one,))
        elif field in ("inputs", "outputs"):
            writer.add_variables(parent, extension(field[:-1]), "type", (one,))
        elif field == "properties":
            add_properties(parent, (one,))
        elif field == "entries":
            writer.add_entries(parent, (one,))
        else:
            empty: dict[str, Any] = dict.fromkeys(DECLARED, ())
            empty[field] = (one,)
            writer.add_declarations(parent, replace(document, **empty))

    return build


def _second(
    build: Callable[[etree._Element, Any], object], one: Any, parent: etree._Element
) -> object:
    return build(parent, one)


def _inside(state: DocState) -> Iterator[DocState]:
    for child in state.children:
        yield child
        yield from _inside(child)


def _all(document: Document) -> Iterator[DocState]:
    pending = [*document.root.children, *document.refine]
    while pending:
        state = pending.pop()
        yield state
        pending += state.children


def located_xml_remarks(source: Source, document: Document) -> Iterator[tuple[str, str]]:
    """Yield the comments of an SCXML chart: the id of the state around it, and its text."""
    file = XmlFile(source, document)
    names = {id(file.tags[key]): _name(state) for key, state in file.known.items()}
    pending: list[tuple[Tag, str]] = [(file.tree.root, "")]
    while pending:
        tag, outer = pending.pop()
        name = names.get(id(tag), outer)
        for remark in file.tree.own_remarks(tag):
            yield name, remark
        pending += [(child, name) for child in tag.children]


def with_xml_remarks(source: Source, document: Document, given: Mapping[str, Iterable[str]]) -> str:
    """Return the text of an SCXML chart with comments at states; without a state, at its start."""
    file = XmlFile(source, document)
    root = file.tree.root
    tags = {_name(state): file.tags[key] for key, state in file.known.items()}
    for state, remarks in given.items():
        tag = tags.get(state, root)
        (root.children[0] if tag is root and root.children else tag).above += remarks
    return file.tree.written()


def _name(state: DocState) -> str:
    return "" if state.id is None else state.id.value
