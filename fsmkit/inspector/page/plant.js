"use strict";
// The picture of a plant: its elements are bound to signals, data and states. It comes from a file
// of somebody, so it passes `safeDrawing`, texts are texts, and only attributes named here change.

class Plant {
  constructor(session, say, act) {
    this.session = session;
    this.say = say;
    this.act = act; // select(machine), changed()
    this.items = [];
    this.signals = new Map(); // name: place
    this.asked = null; // the session whose picture has come
  }

  /** Request the picture of a session until it arrives. */
  async begin() {
    const { hello } = this.session;
    this.signals = new Map((hello.signals || []).map((name, place) => [name, place]));
    if (this.asked === hello.session || !hello.can.includes("picture")) return;
    const picture = await this.say("picture");
    if (picture === undefined) return;
    this.asked = hello.session;
    if (picture) this.build(picture);
    this.act.changed();
  }

  build(picture) {
    const svg = safeDrawing(picture.svg);
    if (!svg) return;
    const box = $("scene") || this.place();
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", "picture of the plant");
    const nodes = new Map([...svg.querySelectorAll("[id]")].map((node) => [node.id, node]));
    for (const node of nodes.values()) node.removeAttribute("id");
    this.groups = new Map();
    this.items = picture.items.filter((item) => nodes.has(item.id)).map((item) => this.bound(item, nodes.get(item.id)));
    const posts = make("div", { class: "posts" });
    const numbers = make("div", { class: "numbers", tabindex: 0, role: "group", "aria-label": "values of the plant" });
    for (const [name, group] of this.groups) {
      if (group.buttons.length) posts.append(make("div", { class: "bar", role: "group", "aria-label": name || "Commands" }, ...(name ? [make("small", {}, name)] : []), ...group.buttons));
      if (group.rows.length) numbers.append(make("table", {}, ...(name ? [make("caption", {}, name)] : []), ...group.rows));
    }
    box.replaceChildren(posts, make("div", { class: "plant" }, svg), numbers);
    this.arrange();
  }

  /** Make room on the page: the picture above the drawing of the machine, and what is shown of them. */
  place() {
    const box = make("section", { id: "scene", "aria-label": "Plant" });
    $("views").before(box);
    const choice = make("div", { class: "bar", role: "group", "aria-label": "Shown" });
    for (const [what, text] of [["plant", "Plant"], ["both", "Both"], ["chart", "Chart"]]) choice.append(make("button", { id: `show-${what}`, onclick: () => this.arrange(what) }, text));
    $("help").before(choice);
    return box;
  }

  arrange(what) {
    this.shown = what || this.shown || "plant";
    document.body.classList.add("has-scene");
    for (const each of ["plant", "both", "chart"]) {
      document.body.classList.toggle(`shows-${each}`, each === this.shown);
      $(`show-${each}`).setAttribute("aria-pressed", String(each === this.shown));
    }
  }

  /** Return an item with its nodes; labelled ones get a button or a row beside the picture. */
  bound(item, node) {
    const made = { ...item, node, base: node.getAttribute("transform") || "", last: {} };
    if (item.post) {
      const post = () => this.say("post", { m: item.post.m, event: item.post.event, with: item.with || {} });
      node.classList.add("live-post");
      node.addEventListener("click", post);
      if (item.label) {
        made.button = make("button", { onclick: post }, item.label);
        this.group(item.group).buttons.push(made.button);
      }
    } else if (item.machine) {
      node.classList.add("live-machine");
      node.addEventListener("click", () => { this.act.select(item.machine); if (this.shown === "plant") this.arrange("both"); });
    }
    if (item.text && item.label) {
      made.cell = make("td", { class: "value" });
      made.row = make("tr", {}, make("th", { scope: "row" }, item.label), made.cell);
      this.group(item.group).rows.push(made.row);
    }
    return made;
  }

  group(name = "") {
    if (!this.groups.has(name)) this.groups.set(name, { buttons: [], rows: [] });
    return this.groups.get(name);
  }

  /** Return the value of a name: a signal, the active state of a machine, or a variable of one. */
  value(name) {
    const place = this.signals.get(name);
    if (place !== undefined) return (this.session.signals || [])[place];
    const { machines } = this.session;
    if (machines.has(name)) {
      return this.leaves(machines.get(name));
    }
    const dot = name.lastIndexOf(".");
    const machine = machines.get(name.slice(0, dot));
    if (!machine || !machine.state) return undefined;
    const variable = name.slice(dot + 1);
    for (const values of [machine.state.outputs, machine.state.data, machine.state.inputs]) if (values && variable in values) return values[variable];
    return undefined;
  }

  /** Return the innermost active states of a machine. */
  leaves({ state, hash }) {
    if (!state || !state.on.length) return undefined;
    const chart = this.session.charts.get(hash);
    const inner = new Set(state.on);
    if (chart) for (const each of chart.states) if (inner.has(each.id)) inner.delete(each.parent);
    return [...inner].join(", ");
  }

  holds({ of, is, value }) {
    const { machines } = this.session;
    const isState = !this.signals.has(of) && machines.has(of);
    if (isState && (is === "=" || is === "!=")) {
      const { state } = machines.get(of);
      return Boolean(state) && state.on.includes(value) === (is === "=");
    }
    const found = this.value(of);
    if (found === undefined || found === null) return is === "!=";
    if (!is) return Boolean(found) && found !== "false";
    const numbers = value !== "" && !Number.isNaN(Number(value)) && typeof found === "number";
    const [one, other] = numbers ? [found, Number(value)] : [String(found), value];
    switch (is) {
      case "=": return one === other;
      case "!=": return one !== other;
      case "<": return one < other;
      case ">": return one > other;
      case "<=": return one <= other;
      default: return one >= other;
    }
  }

  paint() {
    for (const item of this.items) this.update(item);
  }

  update(item) {
    const set = (what, value, change) => { if (item.last[what] !== value) { item.last[what] = value; change(value); } };
    if (item.show) set("show", this.holds(item.show), (on) => { for (const each of [item.node, item.button, item.row]) if (each) showOrHide(each, on); });
    if (item.last.show === false) return;
    if (item.text) {
      set("text", this.text(item), (text) => {
        if (item.cell) item.cell.textContent = text;
        if (item.node.localName === "text" || item.node.localName === "tspan") item.node.textContent = text;
      });
    }
    if (item.class) {
      for (const word of new Set(item.class.map((each) => each.word))) {
        set(`class ${word}`, item.class.some((each) => each.word === word && this.holds(each)), (on) => {
          for (const each of [item.node, item.button, item.row]) if (each) each.classList.toggle(word, on);
        });
      }
    }
    const [x, y, turn] = ["x", "y", "rotate"].map((name) => (item[name] ? mapped(item[name], this.value(item[name].of)) : null));
    if (x !== null || y !== null || turn !== null) {
      const moves = [];
      if (x !== null || y !== null) moves.push(`translate(${x || 0} ${y || 0})`);
      if (turn !== null) moves.push(`rotate(${[turn, ...item.rotate.about].join(" ")})`);
      set("transform", `${moves.join(" ")} ${item.base}`.trim(), (text) => item.node.setAttribute("transform", text));
    }
    for (const name of ["width", "height"]) {
      if (item[name]) set(name, Math.max(0, mapped(item[name], this.value(item[name].of)) || 0), (size) => item.node.setAttribute(name, size));
    }
  }

  text(item) {
    const value = this.value(item.text);
    if (value === undefined || value === null) return "–";
    if (item.words) return item.words[Number(value)] ?? shown(value);
    if (typeof value === "number" && "digits" in item) return value.toFixed(item.digits);
    return typeof value === "string" ? value.replaceAll("_", " ") : shown(value);
  }
}

function showOrHide(node, on) {
  if (node instanceof SVGElement) node.classList.toggle("live-hidden", !on);
  else node.hidden = !on;
}

/** Interpolate between two positions by a value, to a hundredth; null if it is not a number. */
function mapped({ in: [low, high], out: [begin, end] }, value) {
  const number = typeof value === "boolean" ? Number(value) : value;
  if (typeof number !== "number") return null;
  return Math.round(100 * (begin + ((number - low) / (high - low)) * (end - begin))) / 100;
}
