"""Changes of a Document as changes of its YAML file.

The old and the new Document are compared part by part. Parts are the same if they have the same
location object, so moved and changed parts are recognized; what is equal is not touched.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from fsmkit.diagnostics import Source
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.keys import Keys
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.editing.yaml_tree import Item, Node, YamlFile, as_tree, new_item, plain
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.properties import write_properties
from fsmkit.yaml.state_writer import StateWriter
from fsmkit.yaml.transition_writer import (
    KEYS,
    exit_point,
    initial,
    label_text,
    trigger_keys,
    with_trigger,
    without_trigger,
)
from fsmkit.yaml.transitions import BY_NAME, PLAIN
from fsmkit.yaml.writer import chart, declarations
from fsmkit.yaml.writing import WRITE, mapping, targets, write_keys

LABELS = ("on", "after", "every", "always", "sometimes", "choice", "transitions")
"""Keys of a state that hold transitions."""
DECLARATIONS = (
    "types", "constants", "operations", "functions", "events", "capacity", "entries", "properties",
)  # fmt: skip
"""Keys of a chart that hold declarations without a usual form."""


def edited_yaml(source: Source, old: Document, new: Document, *, keeps_comments: bool) -> str:
    """Return the text of a YAML chart after a change.

    Args:
        source: The source of the chart.
        old: Its document.
        new: The document after the change, entry_of_key of parts of the old one.
        keeps_comments: Whether comments of removed parts move to the part around them.

    """
    return _Editor(YamlFile(source), old, new, keeps_comments=keeps_comments).written()


@dataclass(slots=True)
class _Slot:
    """A transition in the file: the item, and the entries around it."""

    item: Item
    trigger: Trigger
    section: Item
    """The key: `on`, `after`, `transitions` ..."""
    label: Item | None = None
    """The entry of the event or delay."""


class _Editor:
    """Changes a file from an old Document to a new one."""

    def __init__(
        self, file: YamlFile, old: Document, new: Document, *, keeps_comments: bool
    ) -> None:
        self.file = file
        self.old, self.new = old, new
        self.keeps_comments = keeps_comments
        self.states: dict[int, Item] = {}
        self.slots: dict[int, _Slot] = {}
        self.known: dict[int, DocState] = {}
        self.carried: dict[int, list[str]] = {}
        """The comments of transitions that move."""
        self.taken: set[int] = set()
        """Transitions that move to another state."""
        self.writer = StateWriter(new, chart)
        self._locate(file.root, "states", old.root.children)
        self._locate(file.root, "refine", old.refine)

    def written(self) -> str:
        root = self.file.root
        if self.new.name.value != self.old.name.value:
            name = root.get("chart")
            if name is not None:
                self.file.replace(name, self.old.name.value, self.new.name.value)
        self._rows(root, self.old, self.new, keys.CHART, None)
        self._declarations(root)
        self._take_moved()
        self._set_initial(root, None, self.old.root, self.new.root, keys.CHART)
        self._children(root, None, "states", self.old.root.children, self.new.root.children)
        self._children(root, None, "refine", self.old.refine, self.new.refine)
        return self.file.written()

    # --- locations ----------------------------------------------------------------------------

    def _locate(self, node: Node, key: str, states: tuple[DocState, ...]) -> None:
        found = node.get(key)
        items = [] if found is None else found.node.items
        if len(items) != len(states):
            raise rejected("the states of the file cannot be located", help="edit the text")
        for item, state in zip(items, states, strict=True):
            self.states[id(state.span)] = item
            self.known[id(state.span)] = state
            slots = list(_slots(item.node))
            if len(slots) != len(state.transitions):
                raise rejected("the transitions cannot be located", help="edit the text")
            for slot, transition in zip(slots, state.transitions, strict=True):
                self.slots[id(transition.span)] = slot
            inner = "regions" if item.node.get("regions") is not None else "states"
            if inner == "regions" and not state.children:
                inner = "states" if item.node.get("states") is not None else inner
            self._locate(item.node, inner, state.children)

    # --- entries ------------------------------------------------------------------------------

    def _keep(self, remarks: list[str], node: Node, around: Item | None, at: int) -> None:
        """Keep the comments of a removed entry: at the entry around it, or at a neighbour."""
        if not remarks:
            return
        if around is None and node.items:
            around = node.items[min(at, len(node.items) - 1)]
        if around is None:
            raise rejected("a comment would be lost", help="edit the text")
        around.above += remarks

    def _remove(self, node: Node, item: Item, around: Item | None) -> None:
        at = node.index(item)
        node.items.remove(item)
        if self.keeps_comments:
            self._keep(self.file.remarks(item), node, around, at)

    def _put_key(self, node: Node, item: Item, order: Iterable[str]) -> None:
        """Insert a key of a mapping at its usual position."""
        ranks = {name: number for number, name in enumerate(order)}
        rank = ranks.get(item.key or "", len(ranks))
        at = 0
        for number, one in enumerate(node.items, 1):
            if ranks.get(one.key or "", -1) <= rank:
                at = number
        node.items.insert(at, item)

    def _set(
        self, node: Node, key: str, before: Tree | None, after: Tree, order: Iterable[str]
    ) -> None:
        """Set a key of a mapping."""
        found = node.get(key)
        if found is not None:
            self.file.replace(found, before, after)
        else:
            self._put_key(node, new_item(key, after), order)

    def _drop(self, node: Node, key: str, around: Item | None) -> None:
        found = node.get(key)
        if found is not None:
            self._remove(node, found, around)

    def _mapping(self, item: Item) -> Node | None:
        """Return the node of an entry if it is a mapping of the file with entries."""
        node = item.node
        return node if node.is_mapping and node.loaded else None

    # --- keys ---------------------------------------------------------------------------------

    def _rows(self, node: Node, old: Any, new: Any, rows: Keys, around: Item | None) -> None:
        """Write the keys of usual forms that changed."""
        for row in rows.values():
            if row.form not in WRITE or getattr(new, row.field) == getattr(old, row.field):
                continue
            if row.is_given(new):
                before = (
                    WRITE[row.form](getattr(old, row.field), row) if row.is_given(old) else None
                )
                after = WRITE[row.form](getattr(new, row.field), row)
                self._set(node, row.name, before, after, rows)
            else:
                self._drop(node, row.name, around)

    def _declarations(self, root: Node) -> None:
        before, after = self._declared(self.old), self._declared(self.new)
        for key in DECLARATIONS:
            if before.get(key) == after.get(key):
                continue
            if key in after:
                self._set(root, key, before.get(key), after[key], keys.CHART)
            else:
                self._drop(root, key, None)

    def _declared(self, document: Document) -> dict[str, Tree]:
        """Return the declarations of a chart; lists of events and operations on one line."""
        found = declarations(document)
        if isinstance(events := found.get("events"), dict):
            found["events"] = {
                key: Short([*one]) for key, one in events.items() if isinstance(one, list)
            }
        if isinstance(operations := found.get("operations"), list):
            found["operations"] = Short(operations)
        if document.entries:
            found["entries"] = Short(
                mapping((e.name, targets(e.targets)) for e in document.entries)
            )
        if document.properties:
            found["properties"] = write_properties(document.properties)
        return found

    # --- states -------------------------------------------------------------------------------

    def _children(
        self,
        node: Node,
        around: Item | None,
        key: str,
        old: tuple[DocState, ...],
        new: tuple[DocState, ...],
    ) -> None:
        """Write the children of a state: those that stay, those that moved here, new ones."""
        if _is_equal(old, new):
            return
        section = node.get(key)
        items = [self._state(state) for state in new]
        if section is None:
            if items:
                entry_of_key = Item(Node(items=items, is_block=True), key)
                self._put_key(node, entry_of_key, keys.STATE if around is not None else keys.CHART)
            return
        gone = [item for item in section.node.items if not any(item is one for one in items)]
        lost = self._lost(gone)
        if items and section.node.is_mapping and section.node.loaded:
            section.node.items[:] = items
        elif items:
            section.above += self.file.inner_remarks(section)
            section.node = Node(items=items, is_block=True)
        elif key == "regions" or (around is None and key == "states"):
            section.node.items.clear()
            section.above += self.file.inner_remarks(section)
            section.node = Node(tree={})
        else:
            section.node.items.clear()
            at = node.index(section)
            node.items.remove(section)
            self._keep(self.file.own_remarks(section), node, around, at)
            section = around
        self._keep(lost, node, section, 0)

    def _lost(self, gone: list[Item]) -> list[str]:
        """Return the comments of states that are gone, but not of those that moved."""
        if not self.keeps_comments:
            return []
        kept = [self.states[id(s.span)] for s in _all(self.new) if id(s.span) in self.states]
        remarks: list[str] = []
        for item in gone:
            if not any(item is one for one in kept):
                remarks += self.remarks_without(item, kept)
        return remarks

    def remarks_without(self, item: Item, kept: list[Item]) -> list[str]:
        """Return the comments of an entry without those of other entries inside it."""
        found = self.file.own_remarks(item)
        for inner in item.node.items:
            if not any(inner is one for one in kept):
                found += self.remarks_without(inner, kept)
        return found

    def _state(self, state: DocState) -> Item:
        """Return the entry of a state after the change."""
        item = self.states.get(id(state.span))
        if item is None:
            return self._new_state(state)
        old = self.known[id(state.span)]
        if old is not state:
            self._change_state(item, old, state)
        return item

    def _new_state(self, state: DocState) -> Item:
        is_new = not any(id(one.span) in self.states for one in _inside(state))
        tree = self.writer.states((state if is_new else _bare(state),), "state")
        (key, value), *_ = tree.items()
        if is_new:
            return new_item(key, value)
        inner = Item(
            Node(items=[self._state(child) for child in state.children], is_block=True),
            "regions" if state.kind is Kind.PARALLEL else "states",
        )
        return Item(Node(items=[inner], is_block=True), key)

    def _change_state(self, item: Item, old: DocState, new: DocState) -> None:
        if old.id != new.id and new.id is not None:
            item.key = new.id.value
        if self._mapping(item) is None:  # the file has nothing but the name
            item.above += self.file.inner_remarks(item)
            item.node = Node(is_block=True)
        node = item.node
        self._kind(node, item, old, new)
        self._rows(node, old, new, keys.STATE, item)
        if (old.done_data, old.done_content) != (new.done_data, new.done_content):
            if done := write_keys(new, keys.DONE):
                self._set(node, "done", write_keys(old, keys.DONE), done, keys.STATE)
            else:
                self._drop(node, "done", item)
        self._set_initial(node, item, old, new, keys.STATE)
        self._used(node, item, old, new)
        if not _is_equal(old.transitions, new.transitions):
            self._transitions(item, old, new)
        key = "regions" if new.kind is Kind.PARALLEL else "states"
        self._children(node, item, key, old.children, new.children)
        if not node.items:
            item.above += self.file.inner_remarks(item)
            item.node = Node(tree={})

    def _kind(self, node: Node, item: Item, old: DocState, new: DocState) -> None:
        if old.kind is new.kind:
            return
        if old.kind is Kind.FINAL:
            self._drop(node, "final", item)
        if old.kind in HISTORIES and new.kind not in HISTORIES:
            self._drop(node, "history", item)
        if new.kind is Kind.FINAL:
            self._set(node, "final", None, "true", keys.STATE)
        if new.kind in HISTORIES:
            self._set(node, "history", None, new.kind.value.split()[0], keys.STATE)
        for section, kind in (("states", Kind.COMPOUND), ("regions", Kind.PARALLEL)):
            found = node.get(section)
            if old.kind is not kind or found is None:
                continue
            if new.kind in (Kind.COMPOUND, Kind.PARALLEL):
                found.key = "regions" if section == "states" else "states"
            elif not old.children:
                self._remove(node, found, item)
        if new.kind in (Kind.COMPOUND, Kind.PARALLEL) and not new.children:
            section = "regions" if new.kind is Kind.PARALLEL else "states"
            if node.get(section) is None:
                self._put_key(node, new_item(section, {}), keys.STATE)
        if new.kind is Kind.CHOICE:
            if (found := node.get("always")) is not None:
                found.key = "choice"
            else:
                self._put_key(node, new_item("choice", []), keys.STATE)
        elif old.kind is Kind.CHOICE and (found := node.get("choice")) is not None:
            if list(_parts_of(found)):
                found.key = "always"
            else:
                self._remove(node, found, item)

    def _set_initial(
        self, node: Node, around: Item | None, old: DocState, new: DocState, rows: Keys
    ) -> None:
        key = "default" if new.kind in HISTORIES else "initial"
        was = "default" if old.kind in HISTORIES else "initial"
        if old.initial == new.initial and key == was:
            return
        if key != was and (found := node.get(was)) is not None:
            found.key = key
        if new.initial is None:
            self._drop(node, key, around)
        else:
            before = None if old.initial is None else initial(old.initial)
            self._set(node, key, before, initial(new.initial), rows)

    def _used(self, node: Node, item: Item, old: DocState, new: DocState) -> None:
        if old.use == new.use:
            return
        if old.use is None or new.use is None:
            raise rejected("the used chart of a state cannot change here", help="edit the text")
        if old.use.exits != new.use.exits:
            if new.use.exits:
                before, after = (
                    mapping((e.name, exit_point(e.transitions)) for e in use.exits)
                    for use in (old.use, new.use)
                )
                self._set(node, "exits", before, after, keys.STATE)
            else:
                self._drop(node, "exits", item)

    # --- transitions --------------------------------------------------------------------------

    def _transitions(self, item: Item, old: DocState, new: DocState) -> None:
        """Write the transitions of a state with few changes, or else as one list."""
        node = item.node
        before = {id(one.span): one for one in old.transitions}
        kept = {id(one.span) for one in new.transitions}
        for one in old.transitions:
            if id(one.span) not in kept and id(one.span) not in self.taken:
                self._take(node, item, one, moves=False)
        moved = _moved(
            [id(one.span) for one in old.transitions if id(one.span) in kept],
            [id(one.span) for one in new.transitions if id(one.span) in before],
        )
        placed: list[DocTransition] = []
        waiting: list[DocTransition] = []
        for one in new.transitions:
            was = before.get(id(one.span))
            if was is None or id(one.span) in moved:
                waiting.append(one)
            elif was is one or self._modify(node, self.slots[id(one.span)], was, one):
                placed.append(one)
            else:
                waiting.append(one)
        for one in waiting:
            if id(one.span) in before:
                self._take(node, item, one, moves=True)
        for one in waiting:
            if not self._insert(node, new, one, placed):
                self._as_list(item, new)
                return
            placed.append(one)
        should = [id(self.slots[id(one.span)].item) for one in new.transitions]
        if [id(slot.item) for slot in _slots(node)] != should:
            self._as_list(item, new)
        elif new.kind is Kind.CHOICE and node.get("choice") is None:
            self._put_key(node, new_item("choice", []), keys.STATE)

    def _take_moved(self) -> None:
        """Remove the transitions that move to another state from where they were."""
        sources = {id(t.span): id(s.span) for s in _all(self.new) for t in s.transitions}
        for state in _all(self.old):
            for one in state.transitions:
                if sources.get(id(one.span), id(state.span)) != id(state.span):
                    item = self.states[id(state.span)]
                    self._take(item.node, item, one, moves=True)
                    self.taken.add(id(one.span))

    def _take(self, node: Node, around: Item, one: DocTransition, *, moves: bool) -> None:
        """Remove a transition, and the entries around it that are empty then.

        If it moves, its comments and those of its trigger go with it.
        """
        slot = self.slots[id(one.span)]
        holders = [h for h in (slot.label, slot.section) if h is not None and h is not slot.item]
        remarks = self.file.remarks(slot.item)
        outer: list[str] = []
        part = slot.item
        for holder in holders:
            holder.node.items.remove(part)
            if holder.node.items:
                break
            outer += self.file.own_remarks(holder)
            part = holder
        else:
            node.items.remove(part)
        if moves:
            self.carried[id(one.span)] = outer + remarks
            return
        around.above += outer
        if self.keeps_comments:
            around.above += remarks

    def _modify(self, node: Node, slot: _Slot, old: DocTransition, new: DocTransition) -> bool:
        """Change a transition in place; return whether its trigger allows that."""
        if (old.trigger, old.events, old.delay) != (new.trigger, new.events, new.delay):
            if slot.section.key == "transitions":
                if not self._relabel(slot, old, new):
                    return False
            elif not self._rename(node, slot, old, new):
                return False
        inner = self._mapping(slot.item)
        if inner is None:
            if without_trigger(old) != without_trigger(new):
                self.file.replace(slot.item, without_trigger(old), without_trigger(new))
            return True
        self._rows(inner, old, new, keys.TRANSITION, slot.item)
        if not inner.items:
            slot.item.node = Node(tree=Short({}))
        return True

    def _relabel(self, slot: _Slot, old: DocTransition, new: DocTransition) -> bool:
        """Change the trigger of an entry of `transitions`."""
        inner = self._mapping(slot.item)
        if inner is None:
            return False
        (was, before), *_ = trigger_keys(old).items()
        (key, after), *_ = trigger_keys(new).items()
        found = inner.get(was)
        if found is None:
            return False
        found.key = key
        self.file.replace(found, before, after)
        return True

    def _rename(self, node: Node, slot: _Slot, old: DocTransition, new: DocTransition) -> bool:
        """Change the event or delay above a single transition."""
        label, text = slot.label, label_text(new)
        if label is None or text is None or old.trigger is not new.trigger:
            return False
        if sum(1 for one in _slots(node) if one.label is label) != 1:
            return False
        others = (one for one in slot.section.node.items if one is not label)
        if any(_words(one.key) == _words(text) for one in others):
            return False
        label.key = text
        return True

    def _insert(
        self, node: Node, state: DocState, one: DocTransition, placed: list[DocTransition]
    ) -> bool:
        """Insert a transition behind its predecessor or before its successor.

        Return whether a key can hold it.
        """
        at = next(n for n, other in enumerate(state.transitions) if other is one)
        ids = {id(other.span) for other in placed}
        near = [t for t in state.transitions[:at] if id(t.span) in ids][-1:]
        near += [t for t in state.transitions[at + 1 :] if id(t.span) in ids][:1]
        slots = [self.slots[id(t.span)] for t in near]
        left = slots[0] if near and near[0] in state.transitions[:at] else None
        key = KEYS[one.trigger]
        if state.kind is Kind.CHOICE and one.trigger is Trigger.EVENTLESS:
            key = "choice"
        section = node.get(key)
        listed = next((slot for slot in slots if slot.section.key == "transitions"), None)
        if listed is not None and not any(slot.section is section for slot in slots):
            item = self._new_transition(one, with_trigger(one))
            _put(listed.section.node, item, listed.item, is_after=listed is left)
            self.slots[id(one.span)] = _Slot(item, one.trigger, listed.section)
            return True
        text = label_text(one)
        if text is None:
            return False
        if section is None:
            section = Item(Node(is_block=True), key)
            beside = next((s for s in slots if s.section in node.items), None)
            if beside is None:
                self._put_key(node, section, keys.STATE)
            else:
                _put(node, section, beside.section, is_after=beside is left)
        elif not list(_parts_of(section)):
            section.node = Node(is_block=True)
        item = self._new_transition(one, without_trigger(one))
        if key in PLAIN:
            self._put_beside(section, item, slots, left)
            self.slots[id(one.span)] = _Slot(item, one.trigger, section)
            return True
        label = next((i for i in section.node.items if _words(i.key) == _words(text)), None)
        if label is not None:
            self._put_beside(label, item, slots, left)
            self.slots[id(one.span)] = _Slot(item, one.trigger, section, label)
            return True
        item.key = text
        beside = next((s for s in slots if s.section is section), None)
        if beside is None or beside.label is None:
            section.node.items.append(item)
        else:
            _put(section.node, item, beside.label, is_after=beside is left)
        self.slots[id(one.span)] = _Slot(item, one.trigger, section, item)
        return True

    def _put_beside(self, holder: Item, item: Item, slots: list[_Slot], left: _Slot | None) -> None:
        """Insert a transition into the list of a key, which may hold a single one so far."""
        if not _is_list(holder.node):
            single = new_item(None, as_tree(self.file.data(holder.node)))
            single.above = self.file.inner_remarks(holder)
            for slot in self.slots.values():
                if slot.item is holder:
                    slot.item = single
            is_file = holder.node.tree is None
            if not is_file:
                single.above += holder.above
                holder.above = []
            holder.node = Node(items=[single], is_block=True)
        beside = next((s for s in slots if any(s.item is i for i in holder.node.items)), None)
        if beside is None:
            holder.node.items.append(item)
        else:
            _put(holder.node, item, beside.item, is_after=beside is left)

    def _new_transition(self, one: DocTransition, tree: Tree) -> Item:
        """Return an entry for a transition that is new or that moved."""
        item = new_item(None, tree)
        item.above = self.carried.pop(id(one.span), [])
        return item

    def _as_list(self, item: Item, state: DocState) -> None:
        """Write all transitions of a state as one list, since no other keys have their order."""
        node = item.node
        sections = [one for one in node.items if one.key in LABELS]
        entry_of_key = Item(Node(is_block=True), "transitions")
        seen: list[Item] = []
        in_file = [slot.item for slot in _slots(node)]
        for one in state.transitions:
            entry = self._new_transition(one, with_trigger(one))
            slot = self.slots.get(id(one.span))
            if slot is not None and any(slot.item is i for i in in_file):
                outer = [
                    h for h in (slot.section, slot.label) if h is not None and h is not slot.item
                ]
                for holder in outer:
                    if not any(holder is s for s in seen):
                        seen.append(holder)
                        entry.above += self.file.own_remarks(holder)
                entry.above += self.file.remarks(slot.item)
            entry_of_key.node.items.append(entry)
            self.slots[id(one.span)] = _Slot(entry, one.trigger, entry_of_key)
        at = node.index(sections[0]) if sections else len(node.items)
        node.items[:] = [one for one in node.items if not any(one is s for s in sections)]
        for section in sections:  # one that holds nothing
            if not any(section is s for s in seen) and not list(_parts_of(section)):
                entry_of_key.above += self.file.remarks(section)
        node.items.insert(min(at, len(node.items)), entry_of_key)
        if state.kind is Kind.CHOICE:
            node.items.insert(node.index(entry_of_key), new_item("choice", []))


def _put(node: Node, item: Item, beside: Item, *, is_after: bool) -> None:
    node.items.insert(node.index(beside) + is_after, item)


def _slots(node: Node) -> Iterator[_Slot]:
    """Yield the transitions of a state, in the order in which they are read."""
    for section in node.items:
        key = section.key or ""
        if key in BY_NAME:
            for label in section.node.items:
                for item in _parts_of(label):
                    yield _Slot(item, BY_NAME[key], section, label)
        elif key in PLAIN or key == "transitions":
            for item in _parts_of(section):
                yield _Slot(item, PLAIN.get(key, Trigger.EVENTLESS), section)


def _parts_of(holder: Item) -> Iterator[Item]:
    """Yield the entries of the transitions under a key: those of a list, or the key's own."""
    node = holder.node
    if _is_list(node):
        yield from node.items
    elif node.tree not in ([], {}):
        yield holder


def _is_list(node: Node) -> bool:
    if node.is_list or (node.tree is not None and plain(node.tree) == []):
        return node.tree is None
    return node.is_block and all(one.key is None for one in node.items)


def _is_equal(old: tuple[Any, ...], new: tuple[Any, ...]) -> bool:
    return len(old) == len(new) and all(a is b for a, b in zip(old, new, strict=True))


def _moved(order: list[int], order_after: list[int]) -> set[int]:
    """Return the items that must move: as few as possible, one if one is enough."""
    if order == order_after:
        return set()
    for one in order:
        if [x for x in order if x != one] == [x for x in order_after if x != one]:
            return {one}
    best: list[list[int]] = []
    rank = {one: number for number, one in enumerate(order)}
    for number, one in enumerate(order_after):
        before = [best[n] for n in range(number) if rank[order_after[n]] < rank[one]]
        best.append([*_longest(before), one])
    return set(order) - set(_longest(best))


def _longest(found: list[list[int]]) -> list[int]:
    longest: list[int] = []
    for one in found:
        longest = one if len(one) > len(longest) else longest
    return longest


def _all(document: Document) -> Iterator[DocState]:
    pending = [*document.root.children, *document.refine]
    while pending:
        state = pending.pop()
        yield state
        pending += state.children


def _inside(state: DocState) -> Iterator[DocState]:
    for child in state.children:
        yield child
        yield from _inside(child)


def _words(text: str | None) -> list[str]:
    return (text or "").replace(",", " ").split()


def _bare(state: DocState) -> DocState:
    """Return a state without its children."""
    kind = Kind.ATOMIC if state.children else state.kind
    return replace(state, children=(), kind=kind)


def located_states(source: Source, document: Document) -> Iterator[tuple[DocState, str]]:
    """Yield the states of a YAML chart with their texts."""
    editor = _Editor(YamlFile(source), document, document, keeps_comments=True)
    for state in _all(document):
        item = editor.states[id(state.span)]
        if item.old is not None:
            end = max(item.old.node.end, item.old.start)
            yield state, source.text[item.old.start : end]


def located_remarks(source: Source, document: Document) -> Iterator[tuple[str, str]]:
    """Yield the comments of a YAML chart: the id of the state around it, and its text."""
    editor = _Editor(YamlFile(source), document, document, keeps_comments=True)
    items = [*editor.states.values()]
    for item in editor.file.root.items:
        for remark in editor.remarks_without(item, items):
            yield "", remark
    for state in _all(document):
        for remark in editor.remarks_without(editor.states[id(state.span)], items):
            yield "" if state.id is None else state.id.value, remark


def with_remarks(source: Source, document: Document, given: Mapping[str, Iterable[str]]) -> str:
    """Return the text of a YAML chart with comments above states; without a state, at its start."""
    editor = _Editor(YamlFile(source), document, document, keeps_comments=True)
    items = {
        state.id.value: editor.states[id(state.span)]
        for state in _all(document)
        if state.id is not None
    }
    for state, remarks in given.items():
        items.get(state, editor.file.root.items[0]).above += remarks
    return editor.file.written()
