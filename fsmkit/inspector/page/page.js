"use strict";
// The page: a transport, a session, and one paint in an animation frame.

const QUESTIONS = new Set(["chart", "events", "branches", "history", "watch"]); // of the page itself: a refusal shown stays
const session = new Session();
const waiting = new Map(); // id: resolve
let lastId = 0;
let selected = null;
let chosen = null;
let isPainting = false;
let saidAt = 0;
let asked = 0;

/** Give a command; resolve to its result, or undefined if it is refused, which is shown. */
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

/** Say whether the session can be reached; nobody answers any more where it cannot. */
function connected(state) {
  notice({ open: "", lost: "The session has ended, or cannot be reached. Trying again ...", closed: "No session answers: open the address that fsmkit serve printed." }[state]);
  if (state === "open") return;
  for (const resolve of waiting.values()) resolve(undefined);
  waiting.clear();
}

function notice(text) {
  $("notice").textContent = text;
  $("notice").hidden = !text;
}

function take(message) {
  if (message.k === "done" || message.k === "refused") {
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
  const { branch } = session.mode;
  session.take(message);
  if (message.k === "hello") begin();
  else if (message.k === "mode" && message.branch !== branch) askBranches();
}

/** Offer the branches that were left, and show the entries of the one in view. */
async function askBranches() {
  const { branch, head } = session.mode;
  await say("history", { from: Math.max(1, head - 500) });
  const others = await say("branches");
  if (!others || branch !== session.mode.branch) return;
  const all = [{ branch, head }, ...others].sort((a, b) => a.branch - b.branch);
  $("branches").replaceChildren(...all.map((each) => make("option", { value: each.branch }, `${each.branch}, to entry ${each.head}`)));
  $("branches").value = branch;
  $("branch").hidden = others.length === 0;
  repaint();
}

function begin() {
  $("name").textContent = session.hello.name;
  document.title = `${session.hello.name} - fsmkit`;
  if (!session.machines.has(selected)) selected = session.hello.machines[0].m;
  for (const hash of new Set(session.hello.machines.map((each) => each.chart))) if (!session.charts.has(hash)) say("chart", { chart: hash });
  askBranches();
}

const drawing = new Drawing(session, (what) => { chosen = what; repaint(); });
const events = new Events(say);
const canCommand = () => Boolean(session.hello) && !session.hello.readonly;

function repaint() {
  if (isPainting) return;
  isPainting = true;
  requestAnimationFrame(() => { isPainting = false; paint(); });
}

function paint() {
  if (!session.hello) return;
  const { mode } = session;
  const tick = session.hello.tick_us;
  $("clock").textContent = duration(mode.at, tick);
  $("run").textContent = mode.mode === "running" ? "Pause" : "Run";
  $("mode").textContent = modeText(mode);
  $("mode").className = ["breakpoint", "fault", "property"].includes((mode.why || [])[0]) ? "stopped" : "";
  for (const id of ["run", "step", "timer", "back", "scrub", "branches"]) $(id).disabled = !canCommand();
  showCards(session, selected, select);
  const machine = session.machines.get(selected);
  const chart = session.charts.get(machine.hash);
  if (chart && machine.state) {
    drawing.show(machine);
    $("title").textContent = machine.name;
    $("path").textContent = machine.state.on.join(" / ");
    drawing.light([...session.points.values()], chosen);
    events.show(machine, chart, canCommand());
    showData(machine, chart, say, canCommand());
    showTimers(machine, chart, mode.at, tick);
    showChosen(machine, chart);
    askEvents(machine);
    tell(machine);
  }
  showPoints(session, say, repaint);
  showHistory(session, (n) => say("seek", { n }));
}

function modeText(mode) {
  const [kind, ...rest] = mode.why || [];
  const lost = session.lost ? `; ${session.lost} messages lost` : "";
  const at = `entry ${mode.n} of ${mode.head}`;
  if (mode.mode === "running") return `running, ${at}${lost}`;
  if (kind === "breakpoint") return `stopped at breakpoint ${rest[0]}${session.points.has(rest[0]) ? ` (${pointText(session.points.get(rest[0]))})` : ""}, ${at}${lost}`;
  if (kind === "fault") return `stopped by the fault ${rest.join(" of ")}, ${at}${lost}`;
  if (kind === "property") return `${at}: the end of the trace of ${rest[0]}${rest[1] === "loop" ? `, which from entry ${rest[2]} on goes round for ever` : ""}${lost}`;
  if (kind === "reloaded") return `loaded anew, ${rest.length ? `the first entry that differs is ${rest[0]}` : "all as before"}${rest[1] ? `; not done again from there on: ${rest[1]}` : ""}, ${at}${lost}`;
  if (kind === "end") return `the end of the recording, ${at}${lost}`;
  if (mode.mode === "following") return `following, ${at}${lost}`;
  if (mode.mode === "frozen") return `frozen, while it goes on, ${at}${lost}`;
  if (kind === "idle") return `nothing is due, ${at}${lost}`;
  return `paused, ${at}${lost}`;
}

/** Ask what the events would do, at most five times a second. */
function askEvents(machine) {
  const now = performance.now();
  const key = `${machine.name} ${session.mode.n} ${session.mode.branch}`;
  if (askEvents.key === key) return;
  if (now - asked < 200) { setTimeout(repaint, 220); return; }
  asked = now;
  askEvents.key = key;
  say("events", { m: machine.name }).then((found) => { if (found && selected === machine.name) events.update(found); });
}

/** Say what is active, at most once a second, to who does not see it. */
function tell(machine) {
  const now = performance.now();
  const text = `${machine.name}: ${machine.state.on.join(", ")}`;
  if (now - saidAt < 1000 || $("said").textContent === text) return;
  saidAt = now;
  $("said").textContent = text;
}

function showChosen(machine, chart) {
  const box = $("chosen");
  const key = chosen ? `${machine.name} ${chosen.kind} ${chosen.index}` : "";
  if (showChosen.key === key) return;
  showChosen.key = key;
  const what = chosen && (chosen.kind === "state" ? chart.states[chosen.index] : chart.transitions[chosen.index]);
  box.hidden = !what;
  if (!what) return;
  const name = chosen.kind === "state" ? what.id : `${what.source}: ${what.label}`;
  const source = chart.sources.find((each) => each.name === what.at.file);
  const line = source ? (source.text.split("\n")[what.at.line - 1] || "").trim() : "";
  box.replaceChildren(make("strong", {}, name), make("span", {}, `${what.at.file}:${what.at.line}`), make("code", {}, line),
    make("button", { disabled: !canCommand(), onclick: breakAtChosen }, "Break here"));
}

async function breakAtChosen() {
  const machine = session.machines.get(selected);
  const chart = session.charts.get(machine.hash);
  if (!chosen) return;
  const point = chosen.kind === "state" ? { on: "entered", m: selected, what: chart.states[chosen.index].id } : { on: "taken", m: selected, what: chosen.index };
  addPoint(point);
}

async function addPoint(point) {
  const number = await say("break", point);
  if (number !== undefined) { session.points.set(number, point); repaint(); }
}

function select(name) {
  selected = name;
  chosen = null;
  repaint();
}

const forward = () => say("step", { how: "macro" });
const speed = () => Number($("speed").value);
const runOrPause = () => (session.mode.mode === "running" ? say("pause") : say("run", { speed: speed() }));

async function save(kind, ending) {
  const text = await say("save", { as: kind });
  if (text === undefined) return;
  const link = make("a", { href: URL.createObjectURL(new Blob([text], { type: "text/plain" })), download: `${session.hello.name.replace(/\W+/g, "_")}${ending}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function listen() {
  $("run").addEventListener("click", runOrPause);
  $("step").addEventListener("click", forward);
  $("timer").addEventListener("click", () => say("step", { how: "timer" }));
  $("back").addEventListener("click", () => say("back"));
  $("speed").addEventListener("change", () => { if (session.mode.mode === "running") say("run", { speed: speed() }); });
  $("scrub").addEventListener("input", () => say("seek", { n: Number($("scrub").value) }));
  $("branches").addEventListener("change", () => say("fork", { branch: Number($("branches").value) }));
  $("follow").addEventListener("click", () => { drawing.setFollowing(!drawing.isFollowing); repaint(); });
  $("whole").addEventListener("click", () => drawing.showWhole());
  $("which").addEventListener("click", () => { drawing.wantsOutline = !drawing.wantsOutline; drawing.arrange(); repaint(); });
  $("help").addEventListener("click", () => $("keys").showModal());
  $("save-script").addEventListener("click", () => save("script", ".txt"));
  $("save-pytest").addEventListener("click", () => save("pytest", "_test.py"));
  $("save-live").addEventListener("click", () => save("live", ".live"));
  $("add-point").addEventListener("submit", (event) => {
    event.preventDefault();
    if ($("condition").value.trim()) addPoint({ on: "condition", m: session.machines.size > 1 && !$("condition").value.includes(".") ? selected : "", what: $("condition").value.trim() });
  });
  const keys = {
    " ": runOrPause, ArrowRight: forward, ArrowLeft: () => say("back"), t: () => say("step", { how: "timer" }),
    Home: () => say("seek", { n: session.mode.first || 0 }), End: () => say("seek", { n: session.mode.head }),
    "/": () => { const button = $("events").querySelector("button"); if (button) button.focus(); }, b: breakAtChosen,
    f: () => $("follow").click(), 0: () => drawing.showWhole(), o: () => $("which").click(), "?": () => $("keys").showModal(),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, textarea") || $("keys").open) return;
    if (event.key === " " && event.target.matches("button")) return;
    if (/^[1-9]$/.test(event.key) && session.machines.size >= Number(event.key)) { select([...session.machines.keys()][Number(event.key) - 1]); return; }
    const act = keys[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  window.addEventListener("resize", repaint);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
}

listen();
transport.connect((message) => { take(message); repaint(); }, connected);
