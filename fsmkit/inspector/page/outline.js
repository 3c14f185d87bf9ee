"use strict";
// The states of a chart as a tree: where there is no drawing, and for those who do not see it.

class Outline {
  constructor(list, choose) {
    this.list = list;
    this.choose = choose;
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
      const row = make("div", { class: "row", onclick: () => this.choose({ kind: "state", index }) }, state.id);
      if (state.kind !== "atomic" && state.kind !== "compound") row.append(" ", make("small", {}, state.kind));
      const item = make("li", { role: "treeitem", "aria-selected": "false", tabindex: "-1" }, row);
      item.addEventListener("keydown", (event) => this.walk(event, item));
      item.addEventListener("focus", (event) => { if (event.target === item) this.choose({ kind: "state", index }); });
      this.items.set(state.id, item);
      let list = lists.get(state.parent);
      if (!list) {
        list = make("ul", { role: "group" });
        this.items.get(state.parent).append(list);
        lists.set(state.parent, list);
      }
      list.append(item);
    });
    const first = this.list.querySelector("[role=treeitem]");
    if (first) first.tabIndex = 0;
  }

  /** Arrows, Home and End go through the tree. */
  walk(event, item) {
    if (event.target !== item) return;
    const all = [...this.list.querySelectorAll("[role=treeitem]")];
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
