"use strict";
// The panels beside the drawing. Each panel keeps its rows and updates changed ones.

/** The events of a machine; `update` puts those first that would do something now. */
class Events {
  constructor(say) {
    this.say = say;
    this.kept = new Map(); // machine: its rows, so that values stay as they were typed
  }

  show(machine, chart, canPost) {
    const key = `${machine.name} ${chart.chart} ${canPost}`;
    if (this.key === key) return;
    this.key = key;
    this.machine = machine;
    this.order = null;
    if (!this.kept.has(key)) this.kept.set(key, this.made(machine.name, chart, canPost));
    this.rows = this.kept.get(key);
    $("events").replaceChildren(...(this.rows.size ? this.rows.values() : [make("p", { class: "none" }, "none")]));
    $("why").hidden = true;
  }

  made(name, chart, canPost) {
    const rows = new Map();
    for (const event of chart.events.filter((each) => each.received)) {
      const fields = event.fields.map((each) => [each.name, field(each.type, undefined, `${each.name} of ${event.name}`)]);
      const payload = () => Object.fromEntries(fields.map(([of, one]) => [of, one.read()]));
      const post = make("button", { class: "post", disabled: !canPost, onclick: () => this.say("post", { m: name, event: event.name, with: payload() }) }, event.name);
      const why = make("button", { class: "ask", title: `why ${event.name} does what it does`, "aria-label": `why ${event.name}`, onclick: () => this.ask(event, payload()) }, "?");
      const labels = fields.map(([of, one]) => make("span", { class: "of" }, make("small", {}, of), one.node));
      rows.set(event.name, make("div", { class: "event" }, post, make("span", { class: "fields" }, ...labels), why));
    }
    return rows;
  }

  update(found) {
    for (const { event, would } of found) {
      const row = this.rows.get(event);
      const name = `event ${would === "yes" ? "yes" : would === "no" ? "no" : "maybe"}`;
      if (row && row.className !== name) row.className = name;
    }
    const rank = { yes: 0, deferred: 1, "?": 1, no: 2 };
    const sorted = [...found].sort((a, b) => (rank[a.would] ?? 1) - (rank[b.would] ?? 1));
    const order = sorted.map((each) => each.event).join("\n");
    const isUsed = $("events").matches(":hover") || $("events").contains(document.activeElement);
    if (order === this.order || (isUsed && this.order !== null)) return; // nothing moves below a finger
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

/** Inputs, results of operations (both can be given), data, outputs and constants, each number with a spark line. */
class Data {
  constructor(say) {
    this.say = say;
    this.rows = new Map();
  }

  show(machine, chart, canSet, canReturn) {
    const key = `${machine.name} ${chart.chart} ${canSet} ${canReturn}`;
    if (this.key !== key) this.build(machine, chart, canSet, canReturn, key);
    const { state } = machine;
    for (const [name, row] of this.rows) {
      const value = state[row.kind][name];
      setAttribute(row.node, "class", machine.changed.has(name) ? "changed" : machine.hasData ? "" : "stale");
      if (row.field) {
        if (row.told !== shown(value) && !row.node.contains(document.activeElement)) row.field.write(value);
      } else setText(row.cell, shown(value));
      row.told = shown(value);
      spark(row.spark, machine.numbers.get(name));
    }
  }

  build(machine, chart, canSet, canReturn, key) {
    this.key = key;
    this.rows = new Map();
    for (const [kind, word, declared] of [["inputs", "input", chart.inputs], ["data", "", chart.data], ["outputs", "output", chart.outputs]]) {
      for (const { name, type } of declared) {
        const row = { kind, spark: shape("svg", { class: "spark", viewBox: "0 0 60 14", "aria-hidden": "true" }, shape("polyline", {})) };
        if (kind === "inputs" && canSet) {
          row.field = field(type, machine.state.inputs[name], `input ${name}`);
          row.field.node.addEventListener("change", () => this.say("set", { m: machine.name, input: name, value: row.field.read() }));
        }
        row.cell = make("td", { class: "value" }, row.field ? row.field.node : "");
        row.node = make("tr", {}, make("th", { scope: "row", title: type.name }, name), row.cell, make("td", { class: "trend" }, row.spark), make("td", {}, make("small", {}, word)));
        this.rows.set(name, row);
      }
    }
    const results = (canReturn ? chart.operations || [] : []).map(({ name, type }) => {
      const result = field(type, undefined, `result of ${name}`);
      const give = make("button", { title: "the operation returns this from here on", "aria-label": `${name} returns this`,
        onclick: () => this.say("returns", { m: machine.name, operation: name, results: [result.read()] }) }, "Return");
      return make("tr", {}, make("th", { scope: "row", title: type.name }, `${name}()`), make("td", { class: "value" }, result.node), make("td", {}, give), make("td", {}, make("small", {}, "result")));
    });
    const constants = chart.constants.map(({ name, value }) => make("tr", {}, make("th", { scope: "row" }, name), make("td", { class: "value" }, shown(value))));
    $("data").replaceChildren(this.rows.size || results.length ? make("table", {}, ...[...this.rows.values()].map((row) => row.node), ...results) : make("p", { class: "none" }, "none"),
      ...(constants.length ? [make("details", {}, make("summary", {}, `${constants.length} constant${constants.length > 1 ? "s" : ""}`), make("table", {}, ...constants))] : []));
  }
}

/** Draw the last values of a number; nothing for a constant one. */
function spark(svg, numbers) {
  const isFlat = !numbers || numbers.length < 2;
  if (svg.classList.contains("flat") !== isFlat) svg.classList.toggle("flat", isFlat);
  if (isFlat) return;
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  const step = 60 / (KEPT_NUMBERS - 1);
  setAttribute(svg.firstChild, "points", numbers.map((v, i) => `${(60 - (numbers.length - 1 - i) * step).toFixed(1)},${high > low ? (13 - (12 * (v - low)) / (high - low)).toFixed(1) : 7}`).join(" "));
}

/** Sampled values of a plant. */
function showSignals(session) {
  const { signals: names = [] } = session.hello;
  $("p-signals").hidden = !names.length;
  if (!names.length || !isSeen($("p-signals"))) return;
  if ($("signals").childElementCount !== 1 || $("signals").firstChild.rows.length !== names.length) {
    $("signals").replaceChildren(make("table", {}, ...names.map((name) => make("tr", {}, make("th", { scope: "row" }, name), make("td", { class: "value" }), make("td", { class: "trend" }, shape("svg", { class: "spark", viewBox: "0 0 60 14", "aria-hidden": "true" }, shape("polyline", {})))))));
  }
  names.forEach((name, i) => {
    const row = $("signals").firstChild.rows[i];
    const value = session.signals[i];
    setText(row.cells[1], typeof value === "number" && !Number.isInteger(value) ? value.toFixed(3) : shown(value));
    spark(row.cells[2].firstChild, session.numbers.get(name));
  });
}

/** Timers, each with a bar of its remaining time and a button that goes there; the queue. */
class Timers {
  constructor(say) {
    this.say = say;
  }

  show(machine, chart, at, tickUs, canStep) {
    const { state } = machine;
    const key = JSON.stringify([machine.name, chart.chart, state.timers, state.queue, state.deferred, canStep, machine.hasData]);
    if (this.key !== key) this.build(machine, chart, canStep, key);
    for (const { deadline, whole, words, bar } of this.bars) {
      const left = Math.max(0, deadline - at);
      setText(words, `in ${duration(left, tickUs)}`);
      bar.style.width = `${(100 * left) / Math.max(whole, left, 1)}%`;
    }
  }

  build(machine, chart, canStep, key) {
    this.key = key;
    const { state } = machine;
    this.bars = [];
    const rows = state.timers.map(([what, deadline]) => {
      const transition = typeof what === "number" ? chart.transitions[what] : null;
      const name = transition ? `${transition.source}: ${triggerOf(transition)}` : shown(what);
      const [words, bar] = [make("span"), make("i")];
      this.bars.push({ deadline, whole: (transition && transition.delay) || 0, words, bar });
      return make("div", { class: "due" }, make("span", { class: "what", title: transition ? transition.label : "" }, name), words,
        make("button", { disabled: !canStep, title: "time moves there", "aria-label": `fire now: ${name}`, onclick: () => this.say("step", { how: "time", at: deadline }) }, "Fire now"),
        make("div", { class: "timer" }, bar));
    });
    const waiting = [["queued", state.queue], ["deferred", state.deferred]].flatMap(([word, all]) => all.map((row) => make("div", {}, `${word}: ${row.map(shown).join(" ")}`)));
    const all = [...rows, ...waiting];
    $("timers").replaceChildren(...(all.length ? all : [make("p", { class: "none" }, "none")]));
  }
}

/** A list with removable items; rebuilt only if its content has changed. */
function showList(box, items) {
  const key = items.map((each) => each.text).join("\n");
  if (box.dataset.key === key && box.childElementCount) return;
  box.dataset.key = key;
  box.replaceChildren(...(items.length ? items.map(({ text, name, go, remove }) => make("div", { class: "item" },
    go ? make("button", { class: "go", onclick: go }, text) : make("span", {}, text),
    ...(remove ? [make("button", { class: "ask", "aria-label": `remove ${name}`, title: "remove", onclick: remove }, "×")] : []))) : [make("p", { class: "none" }, "none")]));
}

/** Cards of the machines of a system: active states, last event, next deadline. */
class Cards {
  constructor(session, act) {
    this.session = session;
    this.act = act; // select(name), add(name)
    this.cards = new Map();
  }

  show(selected, opened) {
    const nav = $("machines");
    const { machines, hello } = this.session;
    nav.hidden = machines.size < 2;
    if (nav.hidden) return;
    if ([...this.cards.keys()].join("\n") !== [...machines.keys()].join("\n")) this.build(nav, machines);
    for (const [name, card] of this.cards) {
      if (!isSeen(card.node)) continue;
      const machine = machines.get(name);
      const { state } = machine;
      const chart = this.session.charts.get(machine.hash);
      const status = state && state.status !== "running" ? ` (${state.fault || state.status})` : "";
      setAttribute(card.button, "aria-pressed", name === selected);
      setAttribute(card.node, "class", `card${machine.taken.length ? " moved" : ""}${state && state.fault ? " broken" : ""}${machine.isKnown ? "" : " stale"}${opened.has(name) ? " opened" : ""}`);
      setText(card.path, state ? leavesOf(chart, state.on).join(", ") + status : "");
      setAttribute(card.path, "title", state && chart ? [...pathsOf(chart, new Set(state.on)).values()].map((path) => path.join(" / ")).join("\n") : "");
      setText(card.last, machine.last);
      const timers = state ? state.timers.slice(0, 3) : [];
      while (card.bars.childElementCount > timers.length) card.bars.lastChild.remove();
      while (card.bars.childElementCount < timers.length) card.bars.append(make("div", { class: "timer" }, make("i")));
      timers.forEach(([what, deadline], i) => {
        const left = Math.max(0, deadline - this.session.mode.at);
        const transition = chart && typeof what === "number" ? chart.transitions[what] : null;
        card.bars.children[i].firstChild.style.width = `${(100 * left) / Math.max((transition && transition.delay) || 0, left, 1)}%`;
        setAttribute(card.bars.children[i], "title", `${transition ? `${transition.source}: ${triggerOf(transition)}` : shown(what)} in ${duration(left, hello.tick_us)}`);
      });
    }
  }

  build(nav, machines) {
    this.cards.clear();
    let number = 0;
    for (const name of machines.keys()) {
      number += 1;
      const [path, last, bars] = [make("span", { class: "now" }), make("span", { class: "last" }), make("span", { class: "bars", "aria-hidden": "true" })];
      const button = make("button", { class: "pick", title: number < 10 ? String(number) : null, onclick: () => this.act.select(name) }, make("span", { class: "name" }, name), path, last);
      const add = make("button", { class: "add", title: "a drawing beside", "aria-label": `draw ${name} beside`, onclick: () => this.act.add(name) }, "+");
      const node = make("div", { class: "card" }, button, add, bars);
      this.cards.set(name, { node, button, path, last, bars });
      watcher.observe(node);
    }
    nav.replaceChildren(...[...this.cards.values()].map((card) => card.node));
  }
}
