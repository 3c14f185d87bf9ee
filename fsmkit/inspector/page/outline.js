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
  }

  show(chart) {
    this.items.clear();
    this.list.replaceChildren();
    const lists = new Map();
    chart.states.forEach((state, index) => {
      if (state.parent === null) {
        lists.set(state.id, this.list);
        return;
      }
      const row = make("div", { class: "row", onclick: () => this.choose({ kind: "state", index }), ondblclick: () => this.foldAt(index) }, state.id);
      if (state.kind !== "atomic" && state.kind !== "compound") row.append(" ", make("small", {}, state.kind));
      const item = make("li", { role: "treeitem", "aria-selected": "false", tabindex: "-1" }, row);
      item.addEventListener("keydown", (event) => this.walk(event, item, index));
      item.addEventListener("focus", (event) => { if (event.target === item) this.choose({ kind: "state", index }); });
      this.items.set(state.id, item);
      let list = lists.get(state.parent);
      if (!list) {
        list = make("ul", { role: "group" });
        this.items.get(state.parent).append(list);
        this.items.get(state.parent).setAttribute("aria-expanded", "true");
        lists.set(state.parent, list);
      }
      list.append(item);
    });
    const first = this.list.querySelector("[role=treeitem]");
    if (first) first.tabIndex = 0;
  }

  /** Show the states in which nothing is shown as such, and all others open. */
  fold(states) {
    for (const [id, item] of this.items) {
      const group = item.querySelector("[role=group]");
      if (!group) continue;
      group.hidden = states.has(id);
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
