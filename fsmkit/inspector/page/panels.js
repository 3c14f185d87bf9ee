"use strict";
// What stands beside the drawing. Each function renders one panel from the session.

/** Return a form for a value of a type, and how to read it. */
function field(type, value) {
  const start = value === undefined ? type.start : value;
  switch (type.kind) {
    case "bool": {
      const input = make("input", { type: "checkbox" });
      input.checked = Boolean(start);
      return { node: input, read: () => input.checked };
    }
    case "enum": {
      const select = make("select", {}, ...type.members.map((name) => make("option", { value: name }, name)));
      select.value = start;
      return { node: select, read: () => select.value };
    }
    case "int": {
      const input = make("input", { type: "number", step: "1", min: shown(type.lo), max: shown(type.hi), value: shown(start) });
      return { node: input, read: () => (Number.isSafeInteger(Number(input.value)) ? Number(input.value) : { int: input.value }) };
    }
    case "float": {
      const input = make("input", { type: "text", inputmode: "decimal", value: shown(start) });
      return { node: input, read: () => (Number.isFinite(Number(input.value)) ? Number(input.value) : { float: input.value }) };
    }
    case "array": {
      const parts = Array.from({ length: type.length }, (_, i) => field(type.of, Array.isArray(start) ? start[i] : undefined));
      return { node: make("span", {}, ...parts.map((p) => p.node)), read: () => parts.map((p) => p.read()) };
    }
    case "record": {
      const parts = type.fields.map((f) => [f.name, field(f.type, start ? start[f.name] : undefined)]);
      return { node: make("span", {}, ...parts.flatMap(([name, p]) => [`${name} `, p.node, " "])), read: () => Object.fromEntries(parts.map(([name, p]) => [name, p.read()])) };
    }
    case "duration": {
      const input = make("input", { type: "number", min: "0", value: shown(start), title: "ticks" });
      return { node: input, read: () => Number(input.value) };
    }
    default: {
      const input = make("input", { type: "text", value: shown(start) });
      return { node: input, read: () => input.value };
    }
  }
}

/** The events of a machine, made once for a chart; `update` marks what would do something. */
class Events {
  constructor(say) {
    this.say = say;
    this.hash = null;
    this.rows = new Map();
  }

  show(machine, chart, canCommand) {
    const key = `${machine.name} ${chart.chart} ${canCommand}`;
    if (this.key === key) return;
    this.key = key;
    this.machine = machine;
    this.rows = new Map();
    for (const event of chart.events.filter((each) => each.received)) {
      const fields = event.fields.map((each) => [each.name, field(each.type)]);
      const payload = () => Object.fromEntries(fields.map(([name, one]) => [name, one.read()]));
      const post = make("button", { class: "post", disabled: !canCommand, onclick: () => this.say("post", { m: machine.name, event: event.name, with: payload() }) }, event.name);
      const why = make("button", { title: `why ${event.name} does what it does`, "aria-label": `why ${event.name}`, onclick: () => this.ask(event, payload()) }, "?");
      const labels = fields.map(([name, one]) => make("label", {}, `${name} `, one.node));
      this.rows.set(event.name, make("div", { class: "event" }, post, ...labels, why));
    }
    $("events").replaceChildren(...(this.rows.size ? this.rows.values() : ["none"]));
    $("why").hidden = true;
  }

  update(found) {
    for (const { event, would } of found) {
      const row = this.rows.get(event);
      if (row) row.className = `event ${would === "yes" ? "yes" : would === "no" ? "no" : "maybe"}`;
    }
    const rank = { yes: 0, deferred: 1, "?": 1, no: 2 };
    const sorted = [...found].sort((a, b) => (rank[a.would] ?? 1) - (rank[b.would] ?? 1));
    const order = sorted.map((each) => each.event).join("\n");
    if (order === this.order || $("events").contains(document.activeElement)) return;
    this.order = order;
    $("events").append(...sorted.map((each) => this.rows.get(each.event)).filter(Boolean));
  }

  async ask(event, payload) {
    const found = await this.say("why", { m: this.machine.name, event: event.name, with: payload });
    if (!found) return;
    const words = { yes: "would be taken", no: "would do nothing", deferred: "would be deferred", "?": "depends on the host", fault: "would end in a fault" };
    const rows = found.looked.map((row) => make("div", {},
      `${row.state}${row.guard ? ` [${row.guard}]` : ""}: ${row.holds === true ? "holds" : row.holds === "?" ? "depends on the host" : "does not hold"}`,
      ...(Object.keys(row.values || {}).length ? [`; ${Object.entries(row.values).map(([k, v]) => `${k} = ${shown(v)}`).join(", ")}`] : []),
      ...(row.error ? [`; ${row.error}`] : [])));
    $("why").replaceChildren(make("strong", {}, `${event.name} ${words[found.would] || found.would}`), ...(found.because ? [make("div", {}, found.because)] : []), ...rows);
    $("why").hidden = false;
  }
}

/** Data, inputs (which can be set) and outputs. */
function showData(machine, chart, say, canCommand) {
  const box = $("data");
  if (box.contains(document.activeElement) && document.activeElement.matches("input, select")) return;
  const rows = [];
  for (const [kind, values, declared] of [["input", machine.state.inputs, chart.inputs], ["", machine.state.data, chart.data], ["output", machine.state.outputs, chart.outputs]]) {
    for (const variable of declared) {
      const value = values[variable.name];
      let cell = shown(value);
      if (kind === "input" && canCommand) {
        const one = field(variable.type, value);
        one.node.setAttribute("aria-label", `input ${variable.name}`);
        one.node.addEventListener("change", () => { one.node.blur(); say("set", { m: machine.name, input: variable.name, value: one.read() }); });
        cell = one.node;
      }
      rows.push(make("tr", { class: machine.changed.has(variable.name) ? "changed" : "" }, make("td", {}, variable.name), make("td", { class: "value" }, cell), make("td", {}, make("small", {}, kind))));
    }
  }
  box.replaceChildren(rows.length ? make("table", {}, ...rows) : "none");
}

/** Timers with the time that is left, and what waits in the queue. */
function showTimers(machine, chart, at, tickUs) {
  const rows = machine.state.timers.map(([what, deadline]) => {
    const transition = typeof what === "number" ? chart.transitions[what] : null;
    const left = Math.max(0, deadline - at);
    const whole = Math.max((transition && transition.delay) || left, left, 1);
    const bar = document.createElementNS(SVG, "svg");
    const rect = document.createElementNS(SVG, "rect");
    rect.setAttribute("width", `${(100 * left) / whole}%`);
    rect.setAttribute("height", "6");
    bar.append(rect);
    return make("div", {}, `${transition ? `${transition.source}: ${transition.label}` : what}, in ${duration(left, tickUs)}`, make("div", { class: "timer" }, bar));
  });
  const queue = machine.state.queue.map((row) => make("div", {}, `queued: ${row.map(shown).join(" ")}`));
  const deferred = machine.state.deferred.map((row) => make("div", {}, `deferred: ${row.map(shown).join(" ")}`));
  const all = [...rows, ...queue, ...deferred];
  $("timers").replaceChildren(...(all.length ? all : ["none"]));
}

function pointText(point) {
  const condition = point.if ? ` if ${point.if}` : "";
  return `${point.on} ${point.m ? `${point.m}: ` : ""}${point.what ?? ""}${condition}`;
}

function showPoints(session, say, repaint) {
  const rows = [...session.points].map(([number, point]) => make("div", { class: "bar" }, make("span", { class: "grow" }, `${number}: ${pointText(point)}`),
    make("button", { "aria-label": `remove breakpoint ${number}`, onclick: async () => { if ((await say("unbreak", { number })) !== undefined) { session.points.delete(number); repaint(); } } }, "remove")));
  $("points").replaceChildren(...(rows.length ? rows : ["none"]));
}

/** Cards of the machines of a system. */
function showCards(session, selected, select) {
  const nav = $("machines");
  nav.hidden = session.machines.size < 2;
  if (nav.hidden) return;
  const names = [...session.machines.keys()];
  if (nav.children.length !== names.length) {
    nav.replaceChildren(...names.map((name) => make("button", { onclick: () => select(name) }, make("span", { class: "name" }, name), make("span", { class: "now" }), make("span", { class: "now" }))));
  }
  names.forEach((name, index) => {
    const machine = session.machines.get(name);
    const card = nav.children[index];
    const { state } = machine;
    const status = state && state.status !== "running" ? ` (${state.fault || state.status})` : "";
    const path = state ? state.on.slice(-1)[0] || "" : "";
    card.setAttribute("aria-pressed", String(name === selected));
    card.className = `${machine.taken.length ? "moved" : ""} ${state && state.fault ? "broken" : ""}`;
    if (card.children[1].textContent !== path + status) card.children[1].textContent = path + status;
    if (card.children[2].textContent !== machine.last) card.children[2].textContent = machine.last;
  });
}

/** The last entries, the scrub bar and a lane for each machine. */
function showHistory(session, seek) {
  const { first = 0, head, n } = session.mode;
  const scrub = $("scrub");
  scrub.min = first; scrub.max = head;
  if (document.activeElement !== scrub || scrub.value < first) scrub.value = n;
  const list = $("entries");
  const [from, to] = [Math.max(first, n - 60), Math.min(head, n + 20)];
  const rows = [];
  for (let at = from; at <= to; at += 1) {
    const entry = session.entries.get(at);
    if (!entry) continue;
    const who = session.machines.size > 1 ? `${entry.m}  ` : "";
    rows.push(make("li", { class: at === n ? "shown" : "", onclick: () => seek(at) }, `${at}  ${duration(entry.at, session.hello.tick_us)}  ${who}${entry.text}`));
  }
  list.replaceChildren(...rows);
  const here = list.querySelector(".shown");
  if (here) list.scrollTop = here.offsetTop - list.offsetTop - list.clientHeight + 24;
  lanes(session);
}

function lanes(session) {
  const canvas = $("lanes");
  const names = [...session.machines.keys()];
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  if (canvas.width !== width) canvas.width = width;
  const pen = canvas.getContext("2d");
  const style = getComputedStyle(document.documentElement);
  pen.clearRect(0, 0, width, height);
  const { first = 0, head, n } = session.mode;
  const last = Math.max(head, first + 1);
  const from = Math.max(first, last - Math.floor(width / 3));
  const lane = height / Math.max(names.length, 1);
  pen.fillStyle = style.getPropertyValue("--taken");
  for (let at = from; at <= last; at += 1) {
    const entry = session.entries.get(at);
    if (entry) pen.fillRect(((at - from) / (last - from)) * (width - 3), names.indexOf(entry.m) * lane + 1, 2, Math.max(lane - 2, 1));
  }
  pen.fillStyle = style.getPropertyValue("--active-line");
  pen.fillRect(((n - from) / (last - from)) * (width - 3), 0, 2, height);
}
