"use strict";
// The states of a chart as a tree: where there is no drawing, and for those who do not see it.

/** Whether a state, not the root, has states in it. */
const isComposite = (chart, index) => chart.states[index].parent !== null && chart.states.some((each) => each.parent === chart.states[index].id);

class Outline {
  constructor(list, choose, foldAt) {
    this.list = list;
    this.choose = choose;
    this.foldAt = foldAt;
    this.items = new Map(); // id of a state: its item
    this.children = new Map(); // id of a state: the states in it and their indices
  }

  /** Show a chart; a state in a folded one gets its item when that is unfolded. */
  show(chart, folded) {
    this.items.clear();
    this.children.clear();
    chart.states.forEach((state, index) => {
      if (!this.children.has(state.parent)) this.children.set(state.parent, []);
      this.children.get(state.parent).push({ state, index });
    });
    this.list.replaceChildren(...(this.children.get(null) || []).flatMap(({ state }) => this.itemsIn(state.id)));
    this.fold(folded);
    const first = this.list.querySelector("[role=treeitem]");
    if (first) first.tabIndex = 0;
  }

  /** Make the items of the states in a state. */
  itemsIn(parent) {
    return (this.children.get(parent) || []).map(({ state, index }) => {
      const row = make("div", { class: "row", onclick: () => this.choose({ kind: "state", index }), ondblclick: () => this.foldAt(index) }, state.id);
      if (state.kind !== "atomic" && state.kind !== "compound") row.append(" ", make("small", {}, state.kind));
      const item = make("li", { role: "treeitem", "aria-selected": "false", tabindex: "-1" }, row);
      item.addEventListener("keydown", (event) => this.walk(event, item, index));
      item.addEventListener("focus", (event) => { if (event.target === item) this.choose({ kind: "state", index }); });
      this.items.set(state.id, item);
      return item;
    });
  }

  /** Show the states in which nothing is shown as such, and all others open. */
  fold(states) {
    for (const [id, item] of this.items) { // the loop reaches the items that it adds, too
      if (!this.children.has(id)) continue;
      let group = item.querySelector("[role=group]");
      if (!group && !states.has(id)) item.append((group = make("ul", { role: "group" }, ...this.itemsIn(id))));
      if (group) group.hidden = states.has(id);
      setAttribute(item, "aria-expanded", !states.has(id));
    }
  }

  /** Arrows, Home and End go through the tree; left folds a state, right unfolds it. */
  walk(event, item, index) {
    if (event.target !== item) return;
    const folds = { ArrowLeft: "true", ArrowRight: "false" }[event.key];
    if (folds && !event.shiftKey && item.getAttribute("aria-expanded") === folds) {
      event.preventDefault();
      event.stopPropagation();
      this.foldAt(index);
      return;
    }
    const all = [...this.list.querySelectorAll("[role=treeitem]")].filter((each) => !each.parentElement.closest("[hidden]"));
    const at = all.indexOf(item);
    const next = all[{ ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: all.length - 1 }[event.key]];
    if (!next) return;
    event.preventDefault();
    event.stopPropagation();
    item.tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  }
}
