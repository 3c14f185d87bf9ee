"use strict";
// One machine in full: its drawing or outline, of which only classes change, and its switches.

/** The parts omitted from all drawings; the server lays them out again. */
const hidden = new Set();

const SMALL = 300; // states; a larger chart gets the items of its outline when that is shown

class View {
  constructor(root, session, act) {
    this.root = root;
    this.session = session;
    this.act = act; // choose(view, what), fold(view, index), hide(), close(view), changed()
    this.name = null;
    this.machine = null;
    this.shown = null;
    this.outlined = null; // the chart of the outline's items
    this.wantsOutline = false;
    this.classes = new Map(); // node: the classes it was given here
    this.nodes = new Map(); // "s12", "t25": what is drawn for it
    this.folded = new Set(); // ids of states
    const choose = (what) => act.choose(this, what);
    this.frame = this.part("drawing");
    this.look = new Look(this.frame, act.changed);
    this.outline = new Outline(this.part("outline"), choose, (index) => act.fold(this, index));
    this.frame.addEventListener("dblclick", (event) => {
      const what = this.meant(event.target);
      if (what && what.kind === "state") act.fold(this, what.index);
    });
    this.frame.addEventListener("click", (event) => { if (!this.look.isDragged) choose(this.meant(event.target)); });
    this.part("follow").addEventListener("click", () => { this.look.setFollowing(!this.look.isFollowing); act.changed(); });
    this.part("whole").addEventListener("click", () => { this.look.showWhole(); act.changed(); });
    this.part("in").addEventListener("click", () => { this.look.zoom(1 / 1.3); act.changed(); });
    this.part("out").addEventListener("click", () => { this.look.zoom(1.3); act.changed(); });
    this.part("which").addEventListener("click", () => { this.wantsOutline = !this.wantsOutline; this.arrange(); act.changed(); });
    this.part("close").addEventListener("click", () => act.close(this));
    for (const what of ["inherited", "watchdogs"]) this.part(what).addEventListener("click", () => act.hide(what));
    watcher.observe(root);
  }

  part(name) {
    return this.root.querySelector(`.${name}`);
  }

  get chart() {
    return this.machine ? this.session.charts.get(this.machine.hash) : null;
  }

  /** Show the machine of that name; lay out anew only where its drawing is another. */
  show(name, isDrawn) {
    this.name = name;
    this.machine = this.session.machines.get(name);
    const { chart } = this;
    if (!chart || !this.machine.state || !isDrawn(chart.chart)) return false;
    setText(this.part("title"), name);
    this.showPaths();
    setAttribute(this.part("follow"), "aria-pressed", this.look.isFollowing);
    for (const what of ["inherited", "watchdogs"]) setAttribute(this.part(what), "aria-pressed", hidden.has(what));
    if (this.shown === chart) return true;
    const isSame = this.shown && this.shown.chart === chart.chart && this.shown.svg === chart.svg;
    this.shown = chart;
    if (isSame) return true;
    this.svg = chart.svg ? safeDrawing(chart.svg) : null;
    this.outlined = null;
    this.classes.clear();
    this.nodes.clear();
    if (this.svg) {
      this.svg.setAttribute("role", "img");
      this.svg.setAttribute("aria-label", `drawing of ${chart.name}`);
      this.svg.prepend(hatching());
      for (const node of this.svg.querySelectorAll("[id]")) {
        const found = /^(?:a_)?([stw])(\d+)(?:_\w+)?$/.exec(node.id);
        if (!found) continue;
        const key = (found[1] === "s" ? "s" : "t") + found[2];
        if (!this.nodes.has(key)) this.nodes.set(key, []);
        if (key !== node.id) this.nodes.get(key).push(node);
        else this.nodes.get(key).unshift(node);
      }
    }
    this.look.show(this.svg);
    for (const what of ["inherited", "watchdogs"]) this.part(what).hidden = !this.svg || !(chart.hides || []).includes(what);
    this.arrange();
    return true;
  }

  /** Show the path of active states: of each region its own. */
  showPaths() {
    const { chart, machine } = this;
    const paths = machine.isKnown ? [...pathsOf(chart, new Set(machine.state.on)).values()].map((path) => path.join(" / ")) : ["not known until the next whole state"];
    const node = this.part("path");
    if (node.title === paths.join("\n") && node.childElementCount) return;
    node.title = paths.join("\n");
    node.replaceChildren(...paths.map((path) => make("span", {}, make("bdi", {}, path))));
  }

  /** Fold states; where no server lays a drawing out anew, in the outline. */
  fold(states) {
    this.folded = states;
    if (this.outlined) this.outline.fold(states);
    if (!this.chart.folds && !this.wantsOutline) {
      this.wantsOutline = true;
      this.arrange();
    }
  }

  arrange() {
    const isOutline = this.wantsOutline || !this.svg;
    this.frame.hidden = isOutline;
    this.outline.list.hidden = !isOutline;
    if (this.shown && this.outlined !== this.shown && (isOutline || this.shown.states.length <= SMALL)) {
      this.outlined = this.shown;
      this.outline.show(this.shown, this.folded);
    }
    const which = this.part("which");
    which.disabled = !this.svg;
    const reason = this.svg ? "" : (this.shown && this.shown.undrawn) || "There is no drawing.";
    which.title = reason || "o";
    setText(this.part("undrawn"), reason);
    this.part("undrawn").hidden = !reason;
    which.textContent = isOutline && this.svg ? "Drawing" : "Outline";
    for (const name of ["follow", "in", "out", "whole"]) this.part(name).disabled = isOutline;
  }

  /** Set the classes of active, left, taken and chosen elements; `micro` replaces the step. */
  light(points, chosen, micro) {
    const { machine, chart } = this;
    const now = micro || { on: machine.state.on, left: machine.left, taken: machine.taken };
    const on = new Set(now.on);
    const left = new Set(now.left.filter((id) => !on.has(id)));
    const wanted = new Map();
    const want = (nodes, name) => { for (const node of nodes || []) wanted.set(node, wanted.has(node) ? `${wanted.get(node)} ${name}` : name); };
    const parents = new Set();
    const active = [];
    chart.states.forEach((state, index) => {
      const both = [...(this.nodes.get(`s${index}`) || []).slice(0, 1), this.outline.items.get(state.id)].filter(Boolean);
      if (on.has(state.id)) {
        want(both, "active");
        parents.add(state.parent);
        active.push([state.id, `s${index}`]);
      }
      if (left.has(state.id)) want(both, "just-left");
      if (!machine.isKnown) want(both, "unknown");
      if (points.some((p) => p.on === "entered" && p.what === state.id && p.m === machine.name)) want(both, "breakpoint");
      if (chosen && chosen.kind === "state" && chosen.index === index) want(both, "chosen");
      const item = this.outline.items.get(state.id);
      if (item) setAttribute(item, "aria-selected", on.has(state.id));
    });
    for (const t of now.taken) want(this.nodes.get(`t${t}`), "just-taken");
    for (const p of points) if (p.on === "taken" && p.m === machine.name) want(this.nodes.get(`t${p.what}`), "breakpoint");
    if (chosen && chosen.kind === "transition") want(this.nodes.get(`t${chosen.index}`), "chosen");
    for (const [node, names] of this.classes) {
      if (wanted.get(node) === names) continue;
      node.classList.remove(...names.split(" "));
      this.classes.delete(node);
    }
    for (const [node, names] of wanted) {
      if (this.classes.has(node)) continue;
      node.classList.add(...names.split(" "));
      this.classes.set(node, names);
    }
    if (!this.svg || this.frame.hidden) return;
    this.look.measure(this.nodes);
    const leaves = [...new Set(active.filter(([id]) => !parents.has(id)).map(([id, key]) => (this.nodes.has(key) ? key : this.around(id))))];
    this.look.follow(leaves, `t${now.taken.at(-1)}`);
    this.look.drawMap(leaves);
  }

  /** Return what is drawn of a state in a folded one: the innermost state around it. */
  around(id) {
    const { states } = this.chart;
    for (let at = id; at !== null; ) {
      const index = states.findIndex((each) => each.id === at);
      if (index < 0 || this.nodes.has(`s${index}`)) return `s${index}`;
      at = states[index].parent;
    }
    return "";
  }

  /** Return the state or transition that a click means. */
  meant(target) {
    for (let at = target.closest("[id]"); at && at !== this.frame; at = at.parentElement && at.parentElement.closest("[id]")) {
      const found = /^(?:a_)?([stw])(\d+)(?:_\w+)?$/.exec(at.id);
      if (found) return { kind: found[1] === "s" ? "state" : "transition", index: Number(found[2]) };
    }
    return null;
  }
}

/** The pattern of states that are not known. */
function hatching() {
  return shape("defs", {}, shape("pattern", { id: "hatch", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    shape("rect", { class: "hatch-ground", width: 6, height: 6 }), shape("rect", { class: "hatch-line", width: 2, height: 6 })));
}
