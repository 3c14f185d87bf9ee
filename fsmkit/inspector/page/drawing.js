"use strict";
// The drawing of one machine, and the outline that stands in for it. Only classes change.

class Drawing {
  constructor(session, choose) {
    this.session = session;
    this.choose = choose;
    this.machine = null;
    this.hash = null;
    this.isFollowing = true;
    this.wantsOutline = false;
    this.marked = [];
    this.moved = 0;
    this.listen();
  }

  get chart() {
    return this.machine ? this.session.charts.get(this.machine.hash) : null;
  }

  /** Show a machine: lay out anew only if its chart is another. */
  show(machine) {
    this.machine = machine;
    const chart = this.chart;
    if (!chart || this.hash === chart.chart) return;
    this.hash = chart.chart;
    const svg = chart.svg ? safeDrawing(chart.svg) : null;
    this.svg = svg;
    $("drawing").replaceChildren(...(svg ? [svg] : []));
    if (svg) {
      this.whole = svg.getAttribute("viewBox").split(/\s+/).map(Number);
      this.box = [...this.whole];
      svg.setAttribute("role", "img");
      svg.setAttribute("aria-label", `drawing of ${chart.name}`);
    }
    this.outline(chart);
    this.arrange();
  }

  arrange() {
    const isOutline = this.wantsOutline || !this.svg;
    $("drawing").hidden = isOutline;
    $("outline").hidden = !isOutline;
    $("which").disabled = !this.svg;
    $("which").textContent = isOutline && this.svg ? "Drawing" : "Outline";
  }

  outline(chart) {
    this.items = new Map();
    const lists = new Map([[null, $("outline")]]);
    $("outline").replaceChildren();
    chart.states.forEach((state, index) => {
      if (state.parent === null) {
        lists.set(state.id, $("outline"));
        return;
      }
      const row = make("div", { class: "row", onclick: () => this.choose({ kind: "state", index }) }, state.id);
      if (state.kind !== "atomic" && state.kind !== "compound") row.append(" ", make("small", {}, state.kind));
      const item = make("li", { role: "treeitem", "aria-selected": "false", tabindex: "-1" }, row);
      item.addEventListener("keydown", (event) => this.walk(event, item));
      item.addEventListener("focus", () => this.choose({ kind: "state", index }));
      this.items.set(state.id, item);
      let list = lists.get(state.parent);
      if (!list) {
        list = make("ul", { role: "group" });
        this.items.get(state.parent).append(list);
        lists.set(state.parent, list);
      }
      list.append(item);
    });
    const first = $("outline").querySelector("[role=treeitem]");
    if (first) first.tabIndex = 0;
  }

  walk(event, item) {
    const all = [...$("outline").querySelectorAll("[role=treeitem]")];
    const next = all[all.indexOf(item) + { ArrowDown: 1, ArrowUp: -1 }[event.key]];
    if (!next) return;
    event.preventDefault();
    event.stopPropagation();
    item.tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  }

  /** Set the classes of what is active, left, taken. */
  light(points, chosen) {
    for (const [node, name] of this.marked) node.classList.remove(name);
    this.marked = [];
    const { machine, chart } = this;
    if (!machine || !chart || !machine.state) return;
    const on = new Set(machine.state.on);
    const left = new Set(machine.left.filter((id) => !on.has(id)));
    chart.states.forEach((state, index) => {
      const names = [];
      if (on.has(state.id)) names.push("active");
      if (left.has(state.id)) names.push("just-left");
      if (points.some((p) => p.on === "entered" && p.what === state.id && p.m === machine.name)) names.push("breakpoint");
      if (chosen && chosen.kind === "state" && chosen.index === index) names.push("chosen");
      for (const name of names) {
        this.mark(this.svg && this.svg.querySelector(`#s${index}`), name);
        this.mark(this.items.get(state.id), name);
      }
      const item = this.items.get(state.id);
      if (item) item.setAttribute("aria-selected", String(on.has(state.id)));
    });
    if (!this.svg) return;
    const taken = [...machine.taken.map((t) => [t, "just-taken"])];
    for (const p of points) if (p.on === "taken" && p.m === machine.name) taken.push([p.what, "breakpoint"]);
    if (chosen && chosen.kind === "transition") taken.push([chosen.index, "chosen"]);
    for (const [t, name] of taken) {
      for (const node of this.svg.querySelectorAll(`[id="t${t}"], [id^="t${t}_"], [id="w${t}"], [id="a_t${t}"]`)) this.mark(node, name);
    }
    if (this.isFollowing) this.follow();
  }

  mark(node, name) {
    if (!node) return;
    node.classList.add(name);
    this.marked.push([node, name]);
  }

  // --- what is seen -----------------------------------------------------------------------------

  /** Move to what is active, at most twice a second, if it has left the middle. */
  follow() {
    const now = performance.now();
    if (!this.svg.isConnected || $("drawing").hidden) return;
    if (now - this.moved < 500) {
      setTimeout(repaint, 510);
      return;
    }
    const { clientWidth: width, clientHeight: height } = $("drawing");
    if (!width || !height) return;
    const readable = (width / this.whole[2]) * 14 >= 11 && (height / this.whole[3]) * 14 >= 11;
    if (readable) return;
    const area = this.area();
    if (!area) return;
    const [x, y, w, h] = this.box;
    const inside = area.x >= x && area.y >= y && area.x + area.width <= x + w && area.y + area.height <= y + h;
    if (inside && w < this.whole[2]) return;
    this.moved = now;
    const scale = Math.max(area.width / width, area.height / height) * 1.15;
    const unit = Math.min(Math.max(scale, 0.9), 14 / 11);
    const [bw, bh] = [width * unit, height * unit];
    this.look([area.x + area.width / 2 - bw / 2, area.y + area.height / 2 - bh / 2, bw, bh]);
  }

  /** Return the smallest box of the active leaves and the arrows just taken. */
  area() {
    const { machine, chart } = this;
    const on = new Set(machine.state.on);
    const parents = new Set(chart.states.filter((s) => on.has(s.id)).map((s) => s.parent));
    const nodes = chart.states.flatMap((s, i) => (on.has(s.id) && !parents.has(s.id) ? [this.svg.querySelector(`#s${i}`)] : []));
    for (const t of machine.taken) nodes.push(this.svg.querySelector(`[id="t${t}"]`));
    const root = this.svg.querySelector("g");
    const shift = root && root.transform.baseVal.consolidate();
    let box = null;
    for (const node of nodes.filter(Boolean)) {
      const one = node.getBBox();
      if (!one.width && !one.height) continue;
      const x = one.x + (shift ? shift.matrix.e : 0);
      const y = one.y + (shift ? shift.matrix.f : 0);
      if (!box) box = { x, y, right: x + one.width, bottom: y + one.height };
      else box = { x: Math.min(box.x, x), y: Math.min(box.y, y), right: Math.max(box.right, x + one.width), bottom: Math.max(box.bottom, y + one.height) };
    }
    return box && { x: box.x, y: box.y, width: box.right - box.x, height: box.bottom - box.y };
  }

  look(box) {
    this.box = box;
    this.svg.setAttribute("viewBox", box.map((v) => v.toFixed(2)).join(" "));
  }

  setFollowing(isFollowing) {
    this.isFollowing = isFollowing;
    $("follow").setAttribute("aria-pressed", String(isFollowing));
  }

  showWhole() {
    this.setFollowing(false);
    if (this.svg) this.look([...this.whole]);
  }

  listen() {
    const frame = $("drawing");
    frame.addEventListener("wheel", (event) => {
      if (!this.svg) return;
      event.preventDefault();
      this.setFollowing(false);
      const by = event.deltaY > 0 ? 1.2 : 1 / 1.2;
      const rect = frame.getBoundingClientRect();
      const [x, y, w, h] = this.box;
      const fx = (event.clientX - rect.left) / rect.width;
      const fy = (event.clientY - rect.top) / rect.height;
      this.look([x + fx * w * (1 - by), y + fy * h * (1 - by), w * by, h * by]);
    }, { passive: false });
    let from = null;
    frame.addEventListener("pointerdown", (event) => { from = { x: event.clientX, y: event.clientY, box: [...this.box], isMoved: false }; });
    window.addEventListener("pointermove", (event) => {
      if (!from || !this.svg) return;
      const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
      if (!from.isMoved && Math.hypot(dx, dy) < 4) return;
      from.isMoved = true;
      this.setFollowing(false);
      const unit = Math.max(from.box[2] / frame.clientWidth, from.box[3] / frame.clientHeight);
      this.look([from.box[0] - dx * unit, from.box[1] - dy * unit, from.box[2], from.box[3]]);
    });
    window.addEventListener("pointerup", () => { const was = from; setTimeout(() => { from = null; }, 0); if (was && was.isMoved) this.dragged = performance.now(); });
    frame.addEventListener("click", (event) => {
      if (this.dragged && performance.now() - this.dragged < 50) return;
      const node = event.target.closest("[id]");
      for (let at = node; at && at !== frame; at = at.parentElement && at.parentElement.closest("[id]")) {
        const found = /^(?:a_)?([stw])(\d+)(?:_\w+)?$/.exec(at.id);
        if (found) {
          this.choose({ kind: found[1] === "s" ? "state" : "transition", index: Number(found[2]) });
          return;
        }
      }
      this.choose(null);
    });
  }
}
