"use strict";
// The page: a transport, a session, and at most one paint in an animation frame.

const QUESTIONS = new Set(["picture", "chart", "events", "branches", "history", "watch", "micro"]); // of the page itself: a shown error stays
const SLOW = 12; // milliseconds of a paint, beyond which there are at most 30 in a second
const session = new Session();
const waiting = new Map(); // id: resolve
let lastId = 0;

/** Give a command; resolve to its result, or show a rejection and resolve to undefined. */
function say(name, fields = {}) {
  lastId += 1;
  const id = lastId;
  if (!QUESTIONS.has(name)) notice("");
  return new Promise((resolve) => {
    waiting.set(id, resolve);
    if (transport.send({ id, do: name, ...fields })) return;
    waiting.delete(id);
    resolve(undefined);
  });
}

const can = (name) => Boolean(session.hello) && !session.hello.readonly && session.hello.can.includes(name);

function notice(text) {
  setText($("notice"), text);
  $("notice").hidden = !text;
}

// --- messages ------------------------------------------------------------------------------------

/** Show whether the session is connected; pending commands fail if it is not. */
function connected(state) {
  notice({ open: "", lost: "The session has ended, or cannot be reached. Trying again ...", closed: "No session answers: open the address that fsmkit serve printed." }[state]);
  if (state === "open") return;
  for (const resolve of waiting.values()) resolve(undefined);
  waiting.clear();
  loading = false;
}

function take(message) {
  if (message.k === "done" || message.k === "refused") {
    session.isAgain = false;
    const resolve = waiting.get(message.re);
    waiting.delete(message.re);
    if (message.k === "refused") notice(message.help ? `${message.message}: ${message.help}` : message.message);
    if (resolve) resolve(message.k === "done" ? message.result ?? null : undefined);
    return;
  }
  if (message.k === "broken") {
    const [first, ...others] = message.findings;
    notice(first ? `${first.at ? `${first.at.file}:${first.at.line}: ` : ""}${first.message}${others.length ? `, and ${others.length} more` : ""}. The session goes on as it was loaded.` : "");
    return;
  }
  const { branch, n } = session.mode;
  session.take(message);
  if (message.k === "hello") begin();
  else if (message.k === "mode" && message.branch !== branch) askBranches();
  if (session.mode.n !== n || session.mode.branch !== branch) micro = null;
}

function begin() {
  const { hello } = session;
  setText($("name"), hello.name);
  document.title = `${hello.name} - fsmkit`;
  if (!session.machines.has(views[0].name)) views[0].name = hello.machines[0].m;
  for (const view of views.slice(1)) if (!session.machines.has(view.name)) closeView(view);
  plant.begin();
  askBranches();
}

/** Offer the branches that were left, and show the entries of the one in view. */
async function askBranches() {
  const { branch, head } = session.mode;
  await say("history", { from: Math.max(1, head - 500) }); // for the sequence diagram
  const others = await say("branches");
  if (!others || branch !== session.mode.branch) return;
  const all = [{ branch, head }, ...others].sort((a, b) => (a.branch ?? 0) - (b.branch ?? 0));
  $("branches").replaceChildren(...all.map((each) => make("option", { value: each.branch ?? 0 }, `${each.branch ?? 0}, to entry ${each.head}`)));
  $("branches").value = branch ?? 0;
  $("branch").hidden = others.length === 0;
  repaint();
}

// Charts are large: they are requested one after the other, and drawings only for those in view.
const askedFor = new Map(); // hash: the parts omitted from its drawing, or UNDRAWN
const UNDRAWN = "-";
const folds = new Map(); // hash: the states that are folded; missing until the server has chosen them

/** Return the layout options of a chart: its omitted parts. */
function layoutOf(hash) {
  const chart = session.charts.get(hash);
  const fold = chart && chart.folds && folds.has(hash) ? [...folds.get(hash)].sort() : null;
  return { hide: [...hidden].sort(), fold };
}

const keyOf = ({ hide, fold }) => `${hide.join()};${fold ? fold.join("\n") : "?"}`;
let loading = false;

/** Whether a chart came with its drawing, if there is one. */
const isDrawn = (hash) => askedFor.get(hash) !== UNDRAWN;

async function askCharts() {
  if (loading || !session.hello) return;
  const inView = views.map((view) => session.machines.get(view.name).hash);
  const toDraw = inView.find((hash) => askedFor.get(hash) !== keyOf(layoutOf(hash)));
  const wanted = toDraw ?? session.hello.machines.map((each) => each.chart).find((hash) => !askedFor.has(hash));
  if (wanted === undefined) return;
  loading = true;
  const layout = layoutOf(wanted);
  askedFor.set(wanted, toDraw ? keyOf(layout) : UNDRAWN);
  await say("chart", toDraw ? { chart: wanted, ...layout } : { chart: wanted, drawn: false });
  if (toDraw && !layout.fold) takeFolds(wanted);
  loading = false;
  repaint();
}

/** Take the folds that the server has chosen for the first drawing of a chart. */
function takeFolds(hash) {
  const chart = session.charts.get(hash);
  if (!chart || !chart.folds || folds.has(hash)) return;
  const chosenFolds = new Set(chart.folded || []);
  folds.set(hash, chosenFolds);
  askedFor.set(hash, keyOf(layoutOf(hash)));
  for (const view of views) if (view.chart === chart) view.fold(chosenFolds);
}

// --- display -------------------------------------------------------------------------------

let chosen = null; // {view, kind, index}
let micro = null; // {n, m, index, rows}: the microsteps of the entry in view, gone through

const act = {
  choose: (view, what) => { chosen = what && { view, ...what }; showChosen(); repaint(); },
  fold: (view, index) => {
    const { chart } = view;
    const id = chart && isComposite(chart, index) && chart.states[index].id;
    if (!id) return;
    const all = folds.get(chart.chart) || new Set();
    folds.set(chart.chart, all);
    if (!all.delete(id)) all.add(id);
    for (const each of views) if (each.chart === chart) each.fold(all);
    showChosen();
    repaint();
  },
  hide: (what) => { if (!hidden.delete(what)) hidden.add(what); repaint(); },
  close: (view) => closeView(view),
  changed: () => repaint(),
  select: (name) => { views[0].name = name; chosen = null; showChosen(); repaint(); },
  add: (name) => {
    const found = views.slice(1).find((view) => view.name === name);
    if (found) closeView(found);
    else if (views.length < 3) openView(name);
    else notice("There are three drawings: remove one first.");
    repaint();
  },
};
const views = [new View($("view"), session, act)];
const events = new Events(say);
const data = new Data(say);
const timers = new Timers(say);
const cards = new Cards(session, act);
const sequence = new Sequence(session);
const seek = (n) => say("seek", { n });
const soughtOnce = throttled(seek, 30); // while a mouse is dragged
const lanes = new Lanes(session, soughtOnce);
const entries = new Entries(session, seek);
const plant = typeof Plant === "function" ? new Plant(session, say, act) : { begin() {}, paint() {} };
const watches = new Map(); // expression: {m, text}
const marks = []; // {name, n, branch}

function openView(name) {
  const root = $("view").cloneNode(true);
  for (const node of [root, ...root.querySelectorAll("[id]")]) node.removeAttribute("id");
  root.querySelector(".drawing").replaceChildren();
  root.querySelector(".close").hidden = false;
  root.setAttribute("aria-label", `Machine ${name}`);
  $("views").append(root);
  const view = new View(root, session, act);
  view.name = name;
  views.push(view);
}

function closeView(view) {
  watcher.unobserve(view.root);
  view.root.remove();
  views.splice(views.indexOf(view), 1);
  repaint();
}

let isPainting = false;
let slowness = 0; // milliseconds of a paint, smoothed
let painted = 0; // when it was last painted
let pictures = 0;

function repaint() {
  if (isPainting) return;
  isPainting = true;
  const wait = slowness > SLOW ? 1000 / 30 - (performance.now() - painted) : 0;
  if (wait > 0) setTimeout(() => requestAnimationFrame(frame), wait);
  else requestAnimationFrame(frame);
}

/** Paint, and find out how long the browser was at it. */
function frame() {
  isPainting = false;
  painted = performance.now();
  paint();
  pictures += 1;
  const { port1, port2 } = new MessageChannel();
  port1.onmessage = () => {
    slowness += 0.2 * (performance.now() - painted - slowness);
    port1.close();
  };
  port2.postMessage(null);
}

function paint() {
  if (!session.hello) return;
  askCharts();
  const { mode } = session;
  setText($("clock"), duration(mode.at, session.hello.tick_us));
  showSpeed(mode.speed ?? 1);
  setText($("run"), { running: "Pause", following: "Freeze", frozen: "Go on" }[mode.mode] || "Run");
  setText($("mode"), micro ? `microstep ${micro.index} of ${micro.rows.length} of entry ${micro.n}` : modeText(session));
  setAttribute($("mode"), "class", isAlarm(mode) ? "stopped" : "");
  for (const [id, command] of [["run", "run"], ["step", "step"], ["timer", "step"], ["back", "back"], ["scrub", "seek"], ["branches", "fork"]]) $(id).disabled = !can(command);
  for (const id of ["timer", "speeds"]) $(id).hidden = ["following", "frozen"].includes(mode.mode);
  $("find").hidden = !can("find");
  $("live").hidden = !can("follow") || mode.mode === "following";
  cards.show(views[0].name, new Set(views.map((view) => view.name)));
  const points = [...session.points.values()];
  for (const view of views) {
    const isHidden = !isSeen(view.root);
    if (isHidden && view !== views[0]) continue;
    if (!view.show(view.name, isDrawn) || isHidden) continue; // panels go by the first, seen or not
    const isMicro = micro && micro.m === view.name && micro.n === mode.n;
    view.light(points, chosen && chosen.view === view ? chosen : null, isMicro ? microOf(view.machine) : null);
  }
  plant.paint();
  paintPanels();
}

const paintPanels = throttled(() => {
  const { mode, hello } = session;
  const { machine, chart } = views[0];
  if (machine && chart && machine.state) {
    events.show(machine, chart, can("post"));
    if (isSeen($("p-data"))) data.show(machine, chart, can("set"), can("returns"));
    if (isSeen($("p-timers"))) timers.show(machine, chart, mode.at, hello.tick_us, can("step") && !["following", "frozen"].includes(mode.mode));
    askEvents(machine);
    tell(machine);
  }
  showSignals(session);
  showList($("points"), [...session.points].map(([number, point]) => ({ text: `${number}: ${pointText(point)}`, name: `breakpoint ${number}`, remove: () => removePoint(number) })));
  showList($("watches"), [...watches].map(([expression, watch]) => ({ text: `${expression} = ${watch.text}`, name: `watch ${expression}`, remove: () => { watches.delete(expression); repaint(); } })));
  showList($("marks"), marks.map((mark, i) => ({ text: `${mark.name}: entry ${mark.n}`, name: `mark ${mark.name}`, go: () => goTo(mark), remove: () => { marks.splice(i, 1); repaint(); } })));
  askWatches();
  if (isSeen($("lane-box"))) lanes.show();
  entries.show();
  askEntries();
  if (!$("sequence").hidden && isSeen($("sequence"))) sequence.show();
}, 60);

/** Return a function that is called at most once in so many milliseconds, the last time for sure. */
function throttled(act_, least) {
  let last = -Infinity;
  let timer = 0;
  let given = [];
  return (...args) => {
    given = args;
    if (timer) return;
    const wait = last + least - performance.now();
    const go = () => { timer = 0; last = performance.now(); act_(...given); };
    if (wait > 0) timer = setTimeout(go, wait);
    else go();
  };
}

/** Request the effects of the events, at most five times a second. */
const askEvents = throttled((machine) => {
  const key = `${machine.name} ${session.mode.n} ${session.mode.branch}`;
  if (askEvents.key === key || !isSeen($("p-events"))) return;
  askEvents.key = key;
  say("events", { m: machine.name }).then((found) => { if (found && views[0].name === machine.name) events.update(found); });
}, 200);

const askWatches = throttled(() => {
  const key = `${session.mode.n} ${session.mode.branch} ${[...watches.keys()].join("\n")}`;
  if (askWatches.key === key) return;
  askWatches.key = key;
  for (const [expression, watch] of watches) {
    say("watch", { expression, m: watch.m }).then((found) => {
      if (!found) watches.delete(expression);
      else watch.text = found.error || shown(found.value);
      repaint();
    });
  }
}, 200);

/** Request the entries around the one in view that this page lacks: after a jump or a loss. */
const askEntries = throttled(() => {
  const { branch, n, head, first = 0 } = session.mode;
  const { from, last } = lanes.window || { from: n, last: n };
  const missing = [];
  for (let at = Math.max(first, 1, Math.min(from, n - EARLIER)); at <= Math.min(head, Math.max(last, n + LATER)); at += 1) if (!session.entries.has(at)) missing.push(at);
  const range = { from: missing[0], last: missing.at(-1) };
  const key = `${branch} ${range.from} ${range.last}`;
  if (!missing.length || askEntries.key === key) return;
  askEntries.key = key;
  say("history", range).then(repaint);
}, 200);

/** Announce the active states to screen readers, at most once a second. */
const tell = throttled((machine) => setText($("said"), `${machine.name}: ${machine.state.on.join(", ")}`), 1000);

// --- selection ------------------------------------------------------------------------------

/** Show the source of a state or transition, and offer to stop there. */
function showChosen() {
  const box = $("chosen");
  const chart = chosen && chosen.view.chart;
  const what = chart && (chosen.kind === "state" ? chart.states[chosen.index] : chart.transitions[chosen.index]);
  box.hidden = !what;
  if (!what) return;
  const name = chosen.kind === "state" ? what.id : `${what.source}${what.targets.length ? ` → ${what.targets.join(", ")}` : ""}: ${what.label}`;
  const source = chart.sources.find((each) => each.name === what.at.file);
  const first = Math.max(1, what.at.line - 2);
  const lines = source ? source.text.split("\n").slice(first - 1, what.at.line + 4) : [];
  box.replaceChildren(
    make("div", { class: "bar" }, make("strong", { class: "grow" }, name), make("button", { class: "ask", "aria-label": "close", onclick: () => act.choose(null, null) }, "×")),
    ...(what.doc ? [make("p", {}, what.doc)] : []),
    make("small", {}, `${what.at.file}:${what.at.line}`),
    make("pre", { class: "source", role: "group", tabindex: "0", "aria-label": "source" }, ...lines.map((line, i) => make("span", { class: first + i === what.at.line ? "here" : "" }, `${String(first + i).padStart(4)} ${line}\n`))),
    make("div", { class: "bar" }, make("button", { disabled: !can("break"), onclick: breakAtChosen }, "Break here"),
      ...(chosen.kind === "state" && isComposite(chart, chosen.index) ? [make("button", { class: "fold", onclick: foldChosen }, (folds.get(chart.chart) || new Set()).has(what.id) ? "Unfold" : "Fold")] : []),
      ...(can("open") && source ? [make("button", { onclick: () => say("open", { file: source.name, line: what.at.line }) }, "Open")] : [])));
}

function foldChosen() {
  if (chosen && chosen.kind === "state") act.fold(chosen.view, chosen.index);
}

async function breakAtChosen() {
  if (!chosen || !chosen.view.chart) return;
  const { chart, name } = chosen.view;
  addPoint(chosen.kind === "state" ? { on: "entered", m: name, what: chart.states[chosen.index].id } : { on: "taken", m: name, what: chosen.index });
}

async function addPoint(point) {
  const number = await say("break", point);
  if (number === undefined) return false;
  session.points.set(number, point);
  repaint();
  return true;
}

async function removePoint(number) {
  if ((await say("unbreak", { number })) === undefined) return;
  session.points.delete(number);
  repaint();
}

/** Return whose names an expression has: those of the machine in view, unless it names machines. */
const ownerOf = (expression) => (session.machines.size > 1 && !/\w+\.\w/.test(expression) ? views[0].name : "");

// --- history -------------------------------------------------------------------------------------

async function goTo(mark) {
  if (mark.branch !== session.mode.branch && (await say("fork", { branch: mark.branch ?? 0 })) === undefined) return;
  seek(mark.n);
}

/** Return what a text describes: `entered opening if n > 2`, `event feeder.start`, or a condition. */
function described(text) {
  const [, on, word, guard] = /^(entered|left|event|sent|taken|fault)\b\s*(\S*)(?:\s+if\s+(.*))?$/.exec(text) || [null, "condition", text];
  if (on === "condition") return { on, m: ownerOf(word), what: word };
  const dot = word.indexOf(".");
  const isNamed = dot > 0 && session.machines.has(word.slice(0, dot));
  const what = isNamed ? word.slice(dot + 1) : word;
  const m = isNamed ? word.slice(0, dot) : views[0].name;
  return { on, m, what: on === "taken" ? Number(what) : what, ...(guard ? { if: guard } : {}) };
}

/** Look for the next entry, or the one before, at which something happens or becomes true. */
async function find(isBack) {
  const text = $("sought").value.trim();
  if (!text) return;
  const wanted = described(text);
  setText($("found"), "...");
  let from = session.mode.n;
  for (;;) {
    const found = await say("find", { ...wanted, from, back: isBack });
    if (!found) { setText($("found"), ""); return; }
    if (found.n !== undefined) {
      await seek(found.n); // the next search starts there
      setText($("found"), `entry ${found.n}`);
      return;
    }
    if (found.from === undefined) { setText($("found"), isBack ? "not before" : "not after"); return; }
    from = found.from;
    setText($("found"), `... ${from}`);
  }
}

let atMicro = Promise.resolve(); // one at a time: an answer may take longer than the next key

/** Go through the microsteps of the entry in view. */
function stepMicro(by) {
  atMicro = atMicro.then(() => goToMicro(by));
}

async function goToMicro(by) {
  const { n } = session.mode;
  if (!micro || micro.n !== n) {
    const entry = session.entries.get(n);
    const rows = entry && (await say("micro", { n }));
    if (!rows || n !== session.mode.n) return;
    micro = { n, m: entry.m, rows, index: by > 0 ? 0 : rows.length + 1 };
    const view = views.find((each) => each.name === entry.m);
    if (!view) views[0].name = entry.m;
  }
  micro.index += by;
  if (micro.index < 1 || micro.index > micro.rows.length) micro = null;
  repaint();
}

/** Return the configuration after the microstep in view, without the later ones. */
function microOf(machine) {
  const on = new Set(machine.state.on);
  for (const row of micro.rows.slice(micro.index).reverse()) {
    for (const id of row.entered) on.delete(id);
    for (const id of row.exited) on.add(id);
  }
  const now = micro.rows[micro.index - 1];
  return { on: [...on], left: now.exited, taken: now.transitions };
}

function showTab(isSequence) {
  for (const [id, isOn] of [["tab-sequence", isSequence], ["tab-entries", !isSequence]]) setAttribute($(id), "aria-pressed", isOn);
  $("sequence").hidden = $("sequence-tools").hidden = !isSequence;
  $("entries").hidden = isSequence;
  repaint();
}

// --- files ---------------------------------------------------------------------------------------

function download(text, name, type = "text/plain") {
  const link = make("a", { href: URL.createObjectURL(new Blob([text], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const fileName = (ending) => `${session.hello.name.replace(/\W+/g, "_")}${ending}`;

async function save(kind, ending) {
  const text = await say("save", { as: kind });
  if (text !== undefined) download(text, fileName(ending));
}

async function showTest() {
  const isOpen = $("save-text").hidden;
  const text = isOpen ? await say("save", { as: "pytest" }) : "";
  if (text === undefined) return;
  $("save-text").textContent = isOpen ? `# ${fileName("_test.py")}\n${text}` : "";
  $("save-text").hidden = !isOpen;
  setAttribute($("save-show"), "aria-expanded", isOpen);
}

// --- hands ---------------------------------------------------------------------------------------

const forward = () => say("step", { how: "macro" });
const speed = () => Number($("speed").value);

/** Select the speed of the session when it changes; one that the list lacks is added. */
function showSpeed(of) {
  if (showSpeed.last === of) return;
  showSpeed.last = of;
  const list = $("speed");
  const next = [...list.options].find(({ value }) => Number(value) >= of || Number(value) === 0);
  if (Number(next.value) !== of) next.before(make("option", { value: of }, of));
  list.value = of;
}

const runOrPause = () => (["running", "following"].includes(session.mode.mode) ? say("pause") : say("run", { speed: speed() }));
const toTimer = () => say("step", { how: "timer" });
const main = () => views[0];

function listen() {
  const on = (id, name, act_) => $(id).addEventListener(name, act_);
  const submitted = (id, input, act_) => on(id, "submit", async (event) => {
    event.preventDefault();
    const text = $(input).value.trim();
    if (text && (await act_(text)) !== false) $(input).value = "";
    repaint();
  });
  on("run", "click", runOrPause);
  on("step", "click", forward);
  on("timer", "click", toTimer);
  on("back", "click", () => say("back"));
  on("live", "click", () => say("follow"));
  on("speed", "change", () => { if (session.mode.mode === "running") say("run", { speed: speed() }); });
  on("scrub", "input", () => { entries.isScrubbing = true; soughtOnce(Number($("scrub").value)); });
  on("scrub", "change", () => { entries.isScrubbing = false; });
  on("branches", "change", () => say("fork", { branch: Number($("branches").value) }));
  on("help", "click", () => $("keys").showModal());
  on("save-script", "click", () => save("script", ".txt"));
  on("save-pytest", "click", () => save("pytest", "_test.py"));
  on("save-c", "click", () => save("c", "_session.c"));
  on("save-live", "click", () => save("live", ".live"));
  on("save-show", "click", showTest);
  on("tab-entries", "click", () => showTab(false));
  on("tab-sequence", "click", () => showTab(true));
  on("sequence-svg", "click", () => download(sequence.asSvg(), fileName(".svg"), "image/svg+xml"));
  on("sequence-mermaid", "click", () => download(sequence.asMermaid(), fileName(".mmd")));
  on("find-back", "click", () => find(true));
  on("find", "submit", (event) => { event.preventDefault(); find(false); });
  submitted("add-point", "condition", (text) => addPoint(described(text)));
  submitted("add-watch", "watched", (expression) => { watches.set(expression, { m: ownerOf(expression), text: "..." }); });
  submitted("add-mark", "marked", (name) => { marks.push({ name, n: session.mode.n, branch: session.mode.branch }); });
  listenToKeys([
    [{ " ": runOrPause }, "run or pause"],
    [{ ArrowLeft: () => say("back"), ArrowRight: forward }, "back; forward, at the end a step"],
    [{ "Shift ArrowLeft": () => stepMicro(-1), "Shift ArrowRight": () => stepMicro(1) }, "microsteps of the entry"],
    [{ t: toTimer }, "to the next timer"],
    [{ Home: () => seek(session.mode.first || 0), End: () => seek(session.mode.head) }, "first, last entry"],
    [{ e: () => { if (!$("live").hidden) say("follow"); } }, "newest entry of what runs elsewhere"],
    [{ "/": () => focusOn("#events button") }, "events"],
    [{ s: () => focusOn("#sought") }, "search the history"],
    [{ b: breakAtChosen }, "break at what is chosen"],
    [{ c: foldChosen }, "fold the state that is chosen, or unfold it"],
    [{ f: () => main().part("follow").click() }, "follow what is active"],
    [{ 0: () => main().part("whole").click(), "+": () => main().part("in").click(), "-": () => main().part("out").click() }, "whole drawing, larger, smaller"],
    [{ h: () => moved(-0.2, 0), j: () => moved(0, 0.2), k: () => moved(0, -0.2), l: () => moved(0.2, 0) }, "move the drawing"],
    [{ i: () => act.hide("inherited"), x: () => act.hide("watchdogs") }, "hide what is inherited, faults"],
    [{ o: () => main().part("which").click() }, "outline or drawing"],
    [{ q: () => showTab($("sequence").hidden) }, "sequence diagram or entries"],
    [{ "?": () => $("keys").showModal() }, "these keys"],
  ], pick);
  window.addEventListener("resize", repaint);
  for (const query of ["(prefers-color-scheme: dark)", "(forced-colors: active)"]) matchMedia(query).addEventListener("change", repaint);
  for (const node of document.querySelectorAll(".panel, #lane-box, #sequence")) watcher.observe(node);
}

/** Show a machine by number, or with shift its drawing beside; return false if it is unknown. */
function pick(number, isBeside) {
  const name = [...session.machines.keys()][number];
  if (name === undefined || session.machines.size < 2) return false;
  if (isBeside) act.add(name);
  else act.select(name);
  return true;
}

function moved(fx, fy) {
  main().look.pan(fx, fy);
  repaint();
}

function focusOn(selector) {
  const found = document.querySelector(selector);
  if (found) found.focus();
}

listen();
transport.connect((message) => { take(message); repaint(); }, connected);
