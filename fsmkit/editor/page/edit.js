// The editor: gestures in the drawing become operations on the text, which the server applies.

let documentOf = null; // the last message about the file
let selected = null; // {kind: "state", id} or {kind: "transition", source, index}
let also = []; // ids of further selected states
let isExtending = false; // whether the click that is handled extends the selection
let isEditing = true;
let unsent = []; // edits that no server took, by batches of operations
let afterEdit = null; // what is done with the next document
let drag = null; // {how: "link", "move", "source" or "target", from, hash, x, y, isMoved}

const KIND_WORDS = { atomic: "State", compound: "Composite", parallel: "Parallel", final: "Final", choice: "Choice", "shallow history": "History" };
const CHILDLESS_KINDS = ["final", "choice", "shallow history", "deep history"];
const SECTION_WORDS = { in: "Events in", out: "Events out", internal: "Internal events", inputs: "Inputs", outputs: "Outputs", data: "Data", constants: "Constants", operations: "Operations", functions: "Functions", types: "Types", capacity: "Capacity" };
const SECTION_HINTS = { in: "open(by 0..9)", out: "opened", internal: "tick", inputs: "name", outputs: "name", data: "name", constants: "NAME", operations: "motor(speed -1..1)", functions: "twice(n 0..9) -> int", types: "Colour", capacity: "queue" };
const VALUE_HINTS = { inputs: "bool", outputs: "bool = false", data: "0..9 = 0", constants: "5s", functions: "2 * n", types: "[red, green]", capacity: "4" };

// --- the document ---------------------------------------------------------------------------------

take = ((inner) => (message) => {
  if (message.k !== "document") {
    inner(message);
    if (message.k === "hello") for (const { chart } of message.machines) if (!session.charts.has(chart)) askedFor.delete(chart);
    return;
  }
  documentOf = message;
  const { then } = afterEdit || {};
  afterEdit = null;
  const before = selected;
  if (then) then();
  if (selected !== before) also = [];
  if (selected && !itemOf(selected)) selected = null;
  also = also.filter((id) => stateOf(id));
  showEditor();
})(take);

connected = ((inner) => (state) => {
  inner(state);
  if (state === "open") showUnsent();
})(connected);

const stateOf = (id) => documentOf && documentOf.states && documentOf.states.find((each) => each.id === id);
const isHistory = (state) => state.kind.endsWith("history");

/** Return what the document has of a selected item. */
function itemOf(what) {
  if (!what) return null;
  const state = stateOf(what.kind === "state" ? what.id : what.source);
  return what.kind === "state" ? state : state && state.transitions[what.index];
}

/** Request edits as one step of undo; `then` runs with the document that has them. */
async function edit(operations, then, { hash = documentOf && documentOf.hash, files = [] } = {}) {
  if (!documentOf) return false;
  const batch = { hash, operations, files };
  afterEdit = then ? { then } : null;
  const done = await say("edit", batch);
  if (done !== undefined) return true;
  afterEdit = null;
  if (!isConnected()) {
    unsent.push(batch);
    showUnsent();
  }
  return false;
}

const isConnected = () => Boolean(transport.socket) && transport.socket.readyState === WebSocket.OPEN;

/** Offer the edits that were made while no server answered. */
function showUnsent() {
  const box = $("edit-unsent");
  box.hidden = !unsent.length;
  if (!unsent.length) return;
  box.replaceChildren(
    make("p", {}, `${unsent.length} edit${unsent.length > 1 ? "s" : ""} could not be sent.`),
    make("button", { onclick: async () => {
      const all = unsent;
      unsent = [];
      for (const { operations } of all) {
        const [{ op, name, new: new_ }] = operations;
        if (op === "RenameSymbol") await rename(name, new_);
        else await edit(operations);
      }
      showUnsent();
    } }, "Make them now"),
    make("button", { onclick: () => { unsent = []; showUnsent(); } }, "Drop them"));
}

// --- selection ------------------------------------------------------------------------------------

/** Return the selected item for an element of the drawing; null for one of another file. */
function documentItem(view, what) {
  const { chart } = view;
  if (!what || !chart || !documentOf || !documentOf.states) return null;
  if (what.kind === "state") {
    const { id } = chart.states[what.index];
    return stateOf(id) ? { kind: "state", id } : null;
  }
  for (const state of documentOf.states) {
    const index = state.transitions.findIndex((each) => each.drawn === what.index);
    if (index >= 0) return { kind: "transition", source: state.id, index };
  }
  return null;
}

/** Return the element of the drawing for a selected item. */
function drawnItem(view, what) {
  const { chart } = view;
  if (!what || !chart) return null;
  if (what.kind === "state") {
    const index = chart.states.findIndex((each) => each.id === what.id);
    return index < 0 ? null : { kind: "state", index };
  }
  const one = itemOf(what);
  return one && one.drawn !== null ? { kind: "transition", index: one.drawn } : null;
}

/** Return the selected states without those inside of others. */
function selectedStates() {
  const all = selected && selected.kind === "state" ? [selected.id, ...also] : [];
  return all.filter((id) => !all.some((other) => inside(other).includes(id)));
}

/** Add a state to the selection, or remove it. */
function toggle(id) {
  const all = selected && selected.kind === "state" ? [selected.id, ...also] : [];
  const [first, ...others] = all.includes(id) ? all.filter((one) => one !== id) : [...all, id];
  [selected, also] = [first ? { kind: "state", id: first } : null, others];
  showEditor();
}

function select(what, focus) {
  [selected, also] = [what, []];
  showEditor();
  if (focus) $("edit-item").focus();
}

act.choose = ((inner) => (view, what) => {
  if (!isEditing) { inner(view, what); return; }
  const item = documentItem(views[0], what);
  const isMore = isExtending && item && item.kind === "state";
  isExtending = false;
  if (isMore) { toggle(item.id); return; }
  [selected, also] = [item, []];
  chosen = what && !selected ? { view, ...what } : null; // it is locked
  showEditor();
  repaint();
})(act.choose);

// --- words of transitions -------------------------------------------------------------------------

/** Return the label of a transition as it is typed: `event [guard] / statements`. */
function labelText(one) {
  const word = { event: one.label, after: `after ${one.label}`, every: `every ${one.label}`, eventless: "", sometimes: "sometimes" }[one.trigger];
  const guard = one.keys.if ? `[${one.keys.if[0]}]` : "";
  const content = one.keys.do ? `/ ${one.keys.do[0].replaceAll("\n", "; ")}` : "";
  return [word, guard, content].filter(Boolean).join(" ");
}

/** Read a typed label; a guard may contain brackets. */
function readLabel(text) {
  let rest = text.trim();
  let content = "";
  let guard = "";
  let depth = 0;
  for (let at = 0; at < rest.length; at += 1) {
    if (rest[at] === "[") depth += 1;
    if (rest[at] === "]") depth -= 1;
    if (rest[at] === "/" && depth === 0) {
      content = rest.slice(at + 1).trim();
      rest = rest.slice(0, at).trim();
      break;
    }
  }
  const open = rest.indexOf("[");
  if (open >= 0) { // the last bracket may be missing
    guard = rest.slice(open + 1, depth === 0 && rest.endsWith("]") ? -1 : undefined).trim();
    rest = rest.slice(0, open).trim();
  }
  const timed = /^(after|every)\s+(.*)$/.exec(rest);
  if (timed) return { trigger: timed[1], label: timed[2].trim(), guard, content };
  if (rest === "sometimes") return { trigger: "sometimes", label: "", guard, content };
  return { trigger: rest ? "event" : "eventless", label: rest.replaceAll(",", " "), guard, content };
}

/** Return declarations of the events that a label names and nothing declares. */
function undeclared({ trigger, label }) {
  if (trigger !== "event" || documentOf.loose || documentOf.extends) return [];
  const known = ["in", "out", "internal"].flatMap((section) => documentOf.declared[section].map(([name]) => name.split("(")[0].trim()));
  return label.split(/\s+/).filter((name) => name && !known.includes(name) && !/[*]|^(done|error)(\.|$)/.test(name)).map((name) => ({ op: "Declare", section: "in", name }));
}

// --- operations -----------------------------------------------------------------------------------

/** Return a name that no state has. */
function freshName(kind) {
  const word = { compound: "group", parallel: "parallel", final: "end", choice: "choice", "shallow history": "history" }[kind] || "state";
  for (let number = 1; ; number += 1) if (!stateOf(`${word}${number}`)) return `${word}${number}`;
}

/** Add a state inside the selected composite, or beside the selected state; then name it. */
async function addState(kind) {
  const here = selected && stateOf(selected.kind === "state" ? selected.id : selected.source);
  const isInside = here && ["compound", "parallel"].includes(here.kind) && selected.kind === "state";
  const parent = isInside ? here.id : (here && here.parent) || "";
  const name = freshName(kind);
  await edit([{ op: "AddState", parent, name, kind }], () => {
    selected = { kind: "state", id: name };
    setTimeout(() => editInPlace());
  });
}

/** Add a transition; then its label is typed. */
async function addTransition(source, target, hash = documentOf.hash) {
  await edit([{ op: "AddTransition", source, targets: [target] }], () => {
    selected = transitionLike(source, { trigger: "eventless", label: "", targets: [target], keys: {} });
    setTimeout(() => editInPlace());
  }, { hash });
}

/** Return the item of the last transition of a state with this trigger, guard and targets. */
function transitionLike(source, { trigger, label, targets, keys }) {
  const state = stateOf(source);
  const guardOf = (each) => (each.if || [""])[0];
  const index = state ? state.transitions.findLastIndex((each) => each.trigger === trigger && each.label === label && each.targets.join() === targets.join() && guardOf(each.keys) === guardOf(keys)) : -1;
  return index < 0 ? null : { kind: "transition", source, index };
}

async function removeSelected() {
  if (!selected) return;
  const operations = selected.kind === "state" ? selectedStates().map((state) => ({ op: "RemoveState", state })) : [{ op: "RemoveTransition", source: selected.source, index: selected.index }];
  const next = selected.kind === "state" ? null : { kind: "state", id: selected.source };
  await edit(operations, () => select(next));
}

/** Rename a state in the file and, after a confirmation, in all files that refer to it. */
async function rename(id, name) {
  if (name === id) return true;
  const operations = [{ op: "RenameSymbol", kind: "state", name: id, new: name }];
  const files = isConnected() ? await say("dependents", { operations }) : [];
  if (!files || (files.length && !(await isConfirmed(id, name, files)))) return false;
  return edit(operations, () => { selected = { kind: "state", id: name }; }, { files });
}

/** Return whether the user confirms that a state is renamed in other files, too. */
function isConfirmed(id, name, files) {
  return new Promise((resolve) => {
    const dialog = make("dialog", { id: "edit-confirm", "aria-labelledby": "h-confirm" },
      make("h2", { id: "h-confirm" }, `Rename ${id} to ${name} in other files?`),
      make("p", {}, "These files refer to the state and change with it:"),
      make("ul", {}, ...files.map((file) => make("li", {}, file))),
      make("div", { class: "bar" }, make("button", { class: "main", onclick: () => dialog.close("all") }, "Rename in all files"), make("button", { onclick: () => dialog.close("") }, "Cancel")));
    dialog.addEventListener("close", () => { dialog.remove(); resolve(dialog.returnValue === "all"); });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Return the operations that set trigger, guard and statements of a transition by its typed label. */
function labelOperations({ source, index }, text) {
  const one = itemOf({ kind: "transition", source, index });
  const { trigger, label, guard, content } = readLabel(text);
  const operations = [];
  if (guard !== (one.keys.if || [""])[0]) operations.push({ op: "SetGuard", source, index, guard });
  if (content !== (one.keys.do || [""])[0].replaceAll("\n", "; ")) operations.push({ op: "SetContent", source, index, content });
  if (trigger !== one.trigger || label !== one.label) operations.push(...undeclared({ trigger, label }), { op: "SetTrigger", source, index, trigger, label });
  return operations;
}

/** Set the label of a transition in one step of undo. */
async function setLabel(what, text) {
  const one = itemOf(what);
  const operations = labelOperations(what, text);
  const { trigger, label, guard } = readLabel(text);
  if (!operations.length) return true;
  return edit(operations, () => { selected = transitionLike(what.source, { ...one, trigger, label, keys: { if: [guard] } }) || what; });
}

// --- clipboard ------------------------------------------------------------------------------------

const HELD = /^\s*(-\s|(transitions|on|after|every|always|sometimes)\s*:)/; // a text of transitions
let copiedText = {}; // the YAML text of the selected item; of: the item, hash: of the file
let lastCopied = ""; // the item that was put into the clipboard
QUESTIONS.add("copy");

const selectionKey = () => JSON.stringify([selected, also]);

/** Return the selected items as YAML text, or undefined. */
async function copyText() {
  const [of, { hash }, { kind, source, index }] = [selectionKey(), documentOf, selected];
  if (copiedText.of === of && copiedText.hash === hash) return copiedText.text;
  const text = await say("copy", { items: kind === "state" ? selectedStates().map((state) => ({ state })) : [{ state: source, index }] });
  if (text !== undefined) copiedText = { of, hash, text };
  return text;
}

/** Whether an event of the clipboard is for the drawing, not for a text. */
const isForDrawing = (event) => isEditing && documentOf && documentOf.read && !event.target.matches("input:not([type=checkbox]), textarea") && (event.type === "paste" || getSelection().isCollapsed);

function copy(event) {
  if (!isForDrawing(event) || !selected) return;
  event.preventDefault();
  lastCopied = selectionKey();
  if (copiedText.of === selectionKey() && copiedText.hash === documentOf.hash) event.clipboardData.setData("text/plain", copiedText.text);
  else copyText().then((text) => { if (text !== undefined) navigator.clipboard.writeText(text); });
  if (event.type === "cut") removeSelected();
}

/** Add the parts of a text; `parent` is the parent of its states and the source of its transitions. */
function paste(text, parent) {
  const known = new Set(documentOf.states.map((each) => each.id));
  const words = ({ trigger, label, targets, keys }) => JSON.stringify([trigger, label, targets, keys]);
  const before = ((stateOf(parent) || {}).transitions || []).map(words);
  return edit([{ op: "Paste", parent, text }], () => {
    const state = documentOf.states.find((each) => !known.has(each.id) && (each.parent || "") === parent);
    if (state) { selected = { kind: "state", id: state.id }; return; }
    const after = ((stateOf(parent) || {}).transitions || []).map(words);
    const index = after.findLastIndex((each) => after.filter((one) => one === each).length > before.filter((one) => one === each).length);
    if (index >= 0) selected = { kind: "transition", source: parent, index };
  });
}

/** Return the parent of the selected state, or the source of the selected transition. */
const aroundSelected = () => (selected.kind === "state" ? stateOf(selected.id).parent || "" : selected.source);

/** Paste states into the selected composite, or beside the selected item, and transitions to the selected state. */
function pasteFrom(event) {
  if (!isForDrawing(event)) return;
  event.preventDefault();
  const text = event.clipboardData.getData("text/plain");
  const state = selected && stateOf(selected.kind === "state" ? selected.id : selected.source);
  if (HELD.test(text)) paste(text, state ? state.id : "");
  else if (!state) paste(text, "");
  else if (selected.kind === "state" && ["compound", "parallel"].includes(state.kind) && lastCopied !== selectionKey()) paste(text, state.id);
  else paste(text, state.parent || "");
}

async function duplicateSelected() {
  if (!selected) return;
  const parent = aroundSelected();
  const text = await copyText();
  if (text !== undefined) paste(text, parent);
}

for (const [name, act_] of [["copy", copy], ["cut", copy], ["paste", pasteFrom]]) document.addEventListener(name, act_);

const undo = () => say("undo");
const redo = () => say("redo");

/** Lay the drawing out anew; otherwise states keep their positions. */
async function tidy() {
  for (const hash of session.charts.keys()) askedFor.delete(hash);
  if ((await say("tidy")) === undefined) return;
  askedFor.clear();
  repaint();
}

// --- completion -----------------------------------------------------------------------------------

let assisted = null; // the field below which completions and findings are shown
let offered = []; // completions
let active = -1; // the one that Enter takes
for (const name of ["complete", "preview"]) QUESTIONS.add(name);

/** Return the part of a label that is typed at the cursor; null where nothing is completed. */
function labelPart(text, cursor) {
  const before = text.slice(0, cursor);
  const events = readLabel(text).trigger === "event" ? readLabel(text).label.split(/\s+/) : [];
  let depth = 0;
  let open = -1;
  for (let at = 0; at < before.length; at += 1) {
    if (before[at] === "[" && depth === 0 && open < 0) open = at;
    if (before[at] === "[") depth += 1;
    if (before[at] === "]") depth -= 1;
    if (before[at] === "/" && depth === 0) return { what: "statements", text: before.slice(at + 1).trimStart(), events };
  }
  if (open >= 0) return depth > 0 ? { what: "guard", text: before.slice(open + 1), events } : null;
  const timed = /^\s*(?:after|every)\s+(.*)$/.exec(before);
  return timed ? { what: "delay", text: timed[1] } : { what: "event", text: /[^\s,]*$/.exec(before)[0] };
}

/** Return completions where the server has none, since the extra `lsp` is not installed. */
function ownCompletions({ what, text }) {
  if (what !== "event") return [];
  const names = ["in", "internal"].flatMap((section) => documentOf.declared[section].map(([name]) => name.split("(")[0].trim()));
  return names.filter((name) => name.startsWith(text)).map((label) => ({ label, detail: "event", insert: label, length: text.length }));
}

/** Show what can be typed in a field, and the findings of its text. */
function showAssistance(findings = null) {
  const box = $("edit-below");
  const [list, found] = box.children;
  list.hidden = !offered.length;
  list.replaceChildren(...offered.map(({ label, detail }, index) => make("li", { id: `edit-option-${index}`, role: "option", "aria-selected": String(index === active), onpointerdown: (event) => { event.preventDefault(); acceptCompletion(index); } }, label, make("small", {}, detail))));
  if (findings) {
    found.replaceChildren(...findings.map(({ severity, message }) => make("p", { class: severity }, message)));
    found.hidden = !findings.length;
  }
  box.hidden = !assisted || (list.hidden && found.hidden);
  if (!assisted) return;
  const { left, bottom } = assisted.getBoundingClientRect();
  box.style.left = `${Math.max(0, Math.min(left, innerWidth - 330))}px`;
  box.style.top = `${bottom + 2}px`;
  if (assisted.matches("input")) setAttribute(assisted, "aria-expanded", !list.hidden);
  if (active >= 0) setAttribute(assisted, "aria-activedescendant", `edit-option-${active}`);
  else assisted.removeAttribute("aria-activedescendant");
  if (active >= 0) list.children[active].scrollIntoView({ block: "nearest" });
}

function closeAssistance(field) {
  if (assisted !== field) return;
  [offered, active] = [[], -1];
  showAssistance([]);
  assisted = null;
}

/** Replace the word before the cursor by a completion. */
function acceptCompletion(index) {
  const { insert, length } = offered[index];
  const at = assisted.selectionStart;
  assisted.setRangeText(insert, at - length, at, "end");
  [offered, active] = [[], -1];
  showAssistance();
  assisted.dispatchEvent(new Event("input"));
}

/** Complete what is typed in a field, and show the findings of its operations below it. */
function assist(field, state, partOf, operationsOf) {
  let turn = 0;
  const ask = async () => {
    turn += 1;
    const [mine, part] = [turn, partOf(field.value, field.selectionStart)];
    const found = part && documentOf.read ? await say("complete", { state, events: null, ...part }) : [];
    if (mine !== turn || document.activeElement !== field) return;
    [assisted, active] = [field, -1];
    offered = (found || ownCompletions(part)).filter(({ insert, length }) => insert !== field.value.slice(field.selectionStart - length, field.selectionStart));
    showAssistance();
  };
  const preview = throttled(async () => {
    const operations = document.activeElement === field ? operationsOf(field.value) : [];
    const found = operations.length ? await say("preview", { hash: documentOf.hash, operations }) : [];
    if (document.activeElement !== field) return;
    assisted = field;
    showAssistance(found || []);
  }, 250);
  setAttribute(field, "aria-autocomplete", "list");
  setAttribute(field, "aria-controls", "edit-completions");
  if (field.matches("input")) for (const [name, value] of [["role", "combobox"], ["aria-expanded", false]]) setAttribute(field, name, value);
  field.addEventListener("input", () => { ask(); preview(); });
  field.addEventListener("blur", () => closeAssistance(field));
  field.addEventListener("keydown", (event) => {
    const { key } = event;
    const isOpen = assisted === field && offered.length > 0;
    if (key === " " && event.ctrlKey) ask();
    else if (isOpen && (key === "ArrowDown" || key === "ArrowUp")) {
      const count = offered.length + 1;
      active = ((active + (key === "ArrowDown" ? 1 : -1) + 1 + count) % count) - 1;
      showAssistance();
    } else if (isOpen && active >= 0 && (key === "Enter" || key === "Tab")) acceptCompletion(active);
    else if (isOpen && key === "Escape") { [offered, active] = [[], -1]; showAssistance(); }
    else return;
    event.preventDefault();
    event.stopImmediatePropagation();
  });
  return field;
}

// --- editing in place -----------------------------------------------------------------------------

/** Open the name of the selected state or the label of the transition where it is drawn. */
function editInPlace() {
  const one = itemOf(selected);
  if (!one || !isEditing) return;
  const what = selected;
  const isState = what.kind === "state";
  const given = isState ? what.id : labelText(one);
  const input = make("input", { id: "edit-inline", value: given, spellcheck: "false", autocomplete: "off",
    "aria-label": isState ? "Name of the state" : "Label of the transition: event [guard] / statements", placeholder: isState ? "name" : "event [guard] / statements" });
  const old = $("edit-inline");
  if (old) old.remove();
  const drawn = drawnItem(views[0], what);
  const node = drawn && (views[0].nodes.get(`${isState ? "s" : "t"}${drawn.index}`) || [])[0];
  const frame = views[0].frame.getBoundingClientRect();
  const box = node ? node.getBoundingClientRect() : frame;
  document.querySelector("main").append(input);
  input.style.left = `${Math.max(frame.left, Math.min(box.left + (isState ? 0 : box.width / 2), frame.right - 260))}px`;
  input.style.top = `${Math.max(frame.top, Math.min(box.top + (isState ? 0 : box.height / 2), frame.bottom - 40))}px`;
  if (isState) assist(input, "", () => null, (name) => (name === what.id ? [] : [{ op: "RenameSymbol", kind: "state", name: what.id, new: name.trim() }]));
  else assist(input, what.source, labelPart, (text) => (itemOf(what) ? labelOperations(what, text) : []));
  let isDone = false;
  const close = () => { isDone = true; input.remove(); $("edit-item").focus(); };
  input.addEventListener("keydown", async (event) => {
    event.stopPropagation();
    if (event.key === "Escape") { close(); return; }
    if (event.key !== "Enter" || isDone) return;
    event.preventDefault();
    isDone = true;
    const isTaken = isState ? await rename(what.id, input.value.trim()) : await setLabel(what, input.value);
    if (isTaken) close();
    else { isDone = false; input.focus(); }
  });
  input.addEventListener("blur", async () => {
    if (isDone) return;
    isDone = true;
    if (input.value !== given) { if (isState) await rename(what.id, input.value.trim()); else await setLabel(what, input.value); }
    input.remove();
  });
  input.focus();
  input.select();
}

// --- the panel ------------------------------------------------------------------------------------

function row(words, control, doc) {
  return make("label", { class: "edit-row", title: doc || null }, make("span", {}, words), control);
}

const LONG = 300; // options
const unfilled = new WeakMap(); // long lists that were not opened yet: a function that adds their options

/** Set the options of a list; a long one has only the selected option until it is opened. */
function setOptions(list, values, value) {
  const options = (those) => those.map(([text, words]) => make("option", { value: text, selected: text === value }, words ?? text));
  const isLong = values.length > LONG;
  list.replaceChildren(...options(isLong ? [values.find(([text]) => text === value) || values[0]] : values));
  if (isLong) unfilled.set(list, () => list.replaceChildren(...options(values)));
  else unfilled.delete(list);
}

/** Add the options of a long list, which is about to be used. */
function fill(list) {
  const add = unfilled.get(list);
  unfilled.delete(list);
  if (add) add();
}

document.addEventListener("pointerdown", (event) => fill(event.target), true);

function choice(values, value, change, attributes = {}) {
  const list = make("select", { ...attributes, onchange: () => change(list.value) });
  setOptions(list, values, value);
  return list;
}

function textBox(value, change, attributes = {}) {
  const isLong = value.includes("\n") || attributes.rows;
  const box = make(isLong ? "textarea" : "input", { spellcheck: "false", autocomplete: "off", ...attributes, ...(isLong ? {} : { value }) }, ...(isLong ? [value] : []));
  const commit = async () => { if (box.value !== value && !(await change(box.value))) box.value = value; };
  box.addEventListener("change", commit);
  box.addEventListener("keydown", (event) => {
    if (event.key === "Escape") { box.value = value; box.blur(); }
    if (event.key === "Enter" && (!isLong || event.ctrlKey)) box.blur();
  });
  return box;
}

/** Make the rows of the table of keys for a chart, a state or a transition. */
function keyRows(rows, keys, name, index, hidden_ = []) {
  return rows.filter((each) => !hidden_.includes(each.name)).map((each) => {
    const value = keys[each.name] || [];
    const set = (list) => edit([{ op: "SetKey", state: name, key: each.name, value: list, index: index ?? null }]);
    if (each.form === "flag") return row(each.name, make("input", { type: "checkbox", checked: value[0] === "true", onchange: (event) => set(event.target.checked ? ["true"] : []) }), each.doc);
    if (each.form === "choice") return row(each.name, choice(each.choices.map((word) => [word]), value[0] || each.choices[0], (word) => set([word])), each.doc);
    const isLong = each.form === "handlers" || each.form === "statements" || each.many;
    const assisted_ = (box) => (["handlers", "statements"].includes(each.form) ? assist(box, name, (text, cursor) => ({ what: "statements", text: text.slice(0, cursor) }), (text) => [{ op: "SetKey", state: name, key: each.name, value: text.trim() ? [text] : [], index: index ?? null }]) : box);
    if (each.form === "handlers") {
      if (value.length > 1) return row(each.name, make("pre", {}, value.join("\n")), each.doc);
      return row(each.name, assisted_(textBox(value[0] || "", (text) => set(text.trim() ? [text] : []), { rows: Math.max(1, (value[0] || "").split("\n").length) })), each.doc);
    }
    const text = value.join("\n");
    return row(each.name, assisted_(textBox(text, (given) => set(each.many ? given.split("\n").map((one) => one.trim()).filter(Boolean) : given.trim() ? [given] : []), isLong ? { rows: Math.max(1, value.length) } : {})), each.doc);
  });
}

/** The names of all states but those inside of one. */
function stateChoices(except) {
  return documentOf.states.filter((each) => each.id !== except).map((each) => [each.id]);
}

function inside(id) {
  const found = new Set([id]);
  for (const each of documentOf.states) if (found.has(each.parent)) found.add(each.id); // parents come first
  found.delete(id);
  return [...found];
}

/** Return the folded states of the drawing. */
const foldedStates = () => folds.get(views[0].chart && views[0].chart.chart) || new Set();

/** Fold the selected composite state, or unfold it. */
function foldSelected() {
  const drawn = selected && selected.kind === "state" ? drawnItem(views[0], selected) : chosen;
  if (!drawn || drawn.kind !== "state") return;
  act.fold(views[0], drawn.index);
  showEditor();
}

/** Return a button that opens the line of an item in the text editor, if the server knows one. */
const opener = (at, words) => (can("open") ? [make("button", { onclick: () => say("open", { file: at.file, line: at.line }) }, words)] : []);

function statePanel(state) {
  const { id } = state;
  const within = inside(id);
  const unfit = new Set([id, ...within]);
  const kinds = [...Object.entries(KIND_WORDS), ["deep history", "Deep history"]];
  const parents = [["", "(the chart)"], ...documentOf.states.filter((each) => !unfit.has(each.id) && !CHILDLESS_KINDS.includes(each.kind) && !each.use).map((each) => [each.id])];
  const hasInitial = state.kind === "compound" || isHistory(state);
  const targets = isHistory(state) ? stateChoices(id) : within.map((each) => [each]);
  return [
    row("name", textBox(id, (name) => rename(id, name.trim()), { id: "edit-name" })),
    ...(state.use ? [row("uses", make("span", {}, state.use))] : [row("kind", choice(kinds, state.kind, (kind) => edit([{ op: "SetKind", state: id, kind }])))]),
    ...(state.refines ? [] : [row("inside", choice(parents, state.parent || "", (parent) => edit([{ op: "MoveState", state: id, parent }])))]),
    ...(hasInitial && state.initial.length < 2 ? [row(isHistory(state) ? "default" : "initial", choice([["", "(first)"], ...targets], state.initial[0] || "", (target) => edit([{ op: "SetInitial", state: id, targets: target ? [target] : [] }])))] : []),
    ...keyRows(documentOf.rows.state, state.keys, id, null),
    make("h2", {}, "Transitions"),
    make("ul", { class: "edit-list" }, ...state.transitions.map((one, index) => make("li", {}, make("button", { onclick: () => select({ kind: "transition", source: id, index }) }, `${labelText(one) || "always"} → ${one.targets.join(", ") || "(stays)"}`)))),
    make("div", { class: "bar" },
      make("button", { id: "edit-add-transition", title: "t", onclick: () => openTargets(id) }, "Transition to ..."),
      ...(state.children ? [make("button", { title: "c", class: "fold", onclick: foldSelected }, foldedStates().has(id) ? "Unfold" : "Fold")] : []),
      ...(state.refines ? [] : [make("button", { onclick: () => { const name = freshName("compound"); edit([{ op: "WrapInState", states: [id], name }], () => { selected = { kind: "state", id: name }; }); } }, "Wrap")]),
      ...(state.kind === "compound" && state.children && !state.refines ? [make("button", { onclick: () => edit([{ op: "UnwrapState", state: id }], () => { selected = null; }) }, "Unwrap")] : []),
      ...opener(state.at, "Show in the text"),
      make("button", { title: "Delete", onclick: removeSelected }, "Remove")),
  ];
}

/** Make the panel of several selected states. */
function statesPanel() {
  const states = selectedStates();
  const wrap = () => { const name = freshName("compound"); edit([{ op: "WrapInState", states, name }], () => select({ kind: "state", id: name })); };
  return [
    make("p", {}, `${also.length + 1} states are selected.`),
    make("ul", { class: "edit-list" }, ...[selected.id, ...also].map((id) => make("li", {}, make("span", { class: "grow" }, id), make("button", { class: "ask", "aria-label": `deselect ${id}`, onclick: () => toggle(id) }, "×")))),
    make("div", { class: "bar" }, make("button", { onclick: wrap }, "Wrap"), make("button", { title: "Delete", onclick: removeSelected }, "Remove")),
  ];
}

/** Let the target of a new transition be picked by the keyboard. */
function openTargets(source) {
  const box = $("edit-targets");
  const list = choice(stateChoices(""), "", () => {}, { id: "edit-target", "aria-label": `Target of a transition from ${source}` });
  const close = () => { box.hidden = true; box.replaceChildren(); };
  const take_ = () => { const target = list.value; close(); addTransition(source, target); };
  list.addEventListener("keydown", (event) => {
    if (event.key === "Enter") { event.preventDefault(); take_(); }
    if (event.key === "Escape") { event.stopPropagation(); close(); $("edit-item").focus(); }
  });
  box.replaceChildren(make("label", { class: "edit-row" }, make("span", {}, `${source} → `), list), make("button", { onclick: take_ }, "Add"));
  box.hidden = false;
  list.focus();
}

function transitionPanel(one, { source, index }) {
  const state = stateOf(source);
  const last = state.transitions.length - 1;
  const move = (to) => edit([{ op: "MoveTransition", source, index, to }], () => { selected = { kind: "transition", source, index: to }; });
  const isOne = one.targets.length < 2;
  return [
    row("label", assist(textBox(labelText(one), (text) => setLabel({ kind: "transition", source, index }, text), { id: "edit-label", placeholder: "event [guard] / statements" }), source, labelPart, (text) => labelOperations({ source, index }, text)), "event [guard] / statements; after 5s, every 5s; nothing: always"),
    row("from", choice(stateChoices(""), source, (to) => edit([{ op: "SetSource", source, index, new: to }], () => { selected = transitionLike(to, one) || { kind: "state", id: to }; }))),
    ...(isOne ? [row("to", choice([["", "(stays)"], ...stateChoices("")], one.targets[0] || "", (to) => edit([{ op: "SetTarget", source, index, targets: to ? [to] : [] }])))] : [row("to", make("span", {}, one.targets.join(", ")))]),
    ...keyRows(documentOf.rows.transition, one.keys, source, index, ["if"]),
    make("div", { class: "bar" },
      make("button", { disabled: index === 0, onclick: () => move(index - 1) }, "Earlier"),
      make("button", { disabled: index === last, onclick: () => move(index + 1) }, "Later"),
      ...opener(one.at, "Show in the text"),
      make("button", { title: "Delete", onclick: removeSelected }, "Remove")),
  ];
}

function chartPanel() {
  const { declared, initial, states } = documentOf;
  const top = states.filter((each) => each.parent === null && !each.refines);
  const sections = Object.keys(SECTION_WORDS).map((section) => {
    const name = make("input", { "aria-label": `${SECTION_WORDS[section]}: name`, placeholder: SECTION_HINTS[section], spellcheck: "false", autocomplete: "off" });
    const value = VALUE_HINTS[section] ? make("input", { "aria-label": `${SECTION_WORDS[section]}: value`, placeholder: VALUE_HINTS[section], spellcheck: "false", autocomplete: "off" }) : null;
    const form = make("form", { class: "edit-declare", id: `edit-declare-${section}`, onsubmit: async (event) => {
      event.preventDefault();
      if (name.value.trim()) await edit([{ op: "Declare", section, name: name.value.trim(), value: value ? value.value.trim() : "" }], () => setTimeout(() => { const next = document.querySelector(`#edit-declare-${section} input`); if (next) next.focus(); }));
    } }, name, ...(value ? [value] : []), make("button", {}, "Add"));
    const items = declared[section].map(([text, given]) => make("li", {}, make("span", { class: "grow" }, given ? `${text}: ${given}` : text),
      make("button", { class: "ask", "aria-label": `remove ${text}`, onclick: () => edit([{ op: "RemoveDeclaration", section, name: text.split(/[ (]/)[0] }]) }, "×")));
    return make("details", { open: declared[section].length > 0 || (document.querySelector(`#edit-section-${section}`) || {}).open || null, id: `edit-section-${section}` }, make("summary", {}, make("h2", {}, `${SECTION_WORDS[section]}`)), make("ul", { class: "edit-list" }, ...items), form);
  });
  return [
    row("name", textBox(documentOf.name, (name) => edit([{ op: "SetKey", state: "", key: "chart", value: [name.trim()] }]))),
    ...(top.length && initial.length < 2 ? [row("initial", choice([["", "(first)"], ...top.map((each) => [each.id])], initial[0] || "", (target) => edit([{ op: "SetInitial", state: "", targets: target ? [target] : [] }])))] : []),
    ...keyRows(documentOf.rows.chart, documentOf.keys, "", null, ["extends", "abstract", "datamodel", "binding"]),
    ...sections,
  ];
}

/** Say why an item of the drawing cannot be edited here. */
function lockedPanel() {
  const chart = views[0].chart;
  const what = chart && chosen && (chosen.kind === "state" ? chart.states[chosen.index] : chart.transitions[chosen.index]);
  if (!what) return null;
  const id = chosen.kind === "state" ? what.id : what.source;
  const isInherited = what.at.file !== documentOf.file;
  return [
    make("p", {}, isInherited ? `It is written in ${what.at.file}, line ${what.at.line}, and locked here.` : "It cannot be edited here."),
    ...(isInherited && documentOf.extends && !stateOf(id) ? [make("button", { onclick: () => edit([{ op: "OverrideState", state: id }], () => { selected = { kind: "state", id }; }) }, "Override here")] : []),
    ...(isInherited ? opener(what.at, "Open its file") : []),
  ];
}

let listed = null; // the document whose items are in the list of items

function itemChoices() {
  const rows = [["", documentOf.name ? `chart ${documentOf.name}` : "chart"]];
  for (const state of documentOf.states || []) {
    rows.push([JSON.stringify({ kind: "state", id: state.id }), state.id]);
    state.transitions.forEach((one, index) => rows.push([JSON.stringify({ kind: "transition", source: state.id, index }), `${state.id}: ${labelText(one) || "always"} → ${one.targets.join(", ") || "(stays)"}`]));
  }
  return rows;
}

function showEditor() {
  if (!documentOf) return;
  document.body.classList.toggle("editing", isEditing);
  setAttribute($("mode-edit"), "aria-pressed", isEditing);
  setAttribute($("mode-run"), "aria-pressed", !isEditing);
  $("mode-run").disabled = !documentOf.valid;
  $("mode-run").title = documentOf.valid ? "" : "The chart has errors: correct them to run it.";
  if (!documentOf.valid && !isEditing) setMode(true);
  $("edit-undo").disabled = !documentOf.undo;
  $("edit-redo").disabled = !documentOf.redo;
  const isEmpty = documentOf.read && !documentOf.states.length && !documentOf.extends;
  document.body.classList.toggle("edit-empty", isEmpty);
  $("edit-hint").hidden = !isEmpty;
  showVerdicts(documentOf.verdicts);
  if (!isEditing) return;
  const active = document.activeElement;
  const isTyping = active && $("edit-panel").contains(active) && active.matches("input, textarea, select");
  const focus = isTyping && active.id ? active.id : "";
  const item = documentOf.read && itemOf(selected);
  setText($("edit-text"), documentOf.text);
  $("edit-palette").hidden = !documentOf.read;
  $("edit-item").parentElement.hidden = !documentOf.read;
  if (!documentOf.read) {
    $("edit-source").open = true;
    $("edit-panel").replaceChildren(make("p", {}, "The file cannot be read as a chart. Nothing is lost: this is its text. Correct it in an editor; the drawing follows."));
  } else {
    const value = selected ? JSON.stringify(selected) : "";
    const items = $("edit-item");
    if (listed !== documentOf || unfilled.has(items)) setOptions(items, itemChoices(), value);
    else items.value = value;
    listed = documentOf;
    const rows = item && also.length ? statesPanel() : item ? (selected.kind === "state" ? statePanel(item) : transitionPanel(item, selected)) : (chosen && lockedPanel()) || chartPanel();
    $("edit-panel").replaceChildren(...rows);
    if (focus && $(focus)) $(focus).focus();
  }
  if (item) copyText(); // it is ready when Ctrl C is pressed
  showFindings();
  repaint();
}

/** List the findings. */
function showFindings() {
  const { findings } = documentOf;
  $("edit-findings").replaceChildren(...findings.map((each) => make("li", { class: each.severity }, make("button", { onclick: () => { const found = itemAt(each.at); if (found) select(found); } }, `${each.at ? `line ${each.at.line}: ` : ""}${each.message}`), ...(each.help ? [make("small", {}, each.help)] : []))));
  $("edit-problems").hidden = !findings.length;
}

/** Show the verdicts of the last check; those with a trace are buttons that show it. */
function showVerdicts(verdicts) {
  const { traced } = documentOf;
  const chips = verdicts.map(({ name, result, words, text, traced: isTraced }) => {
    const attributes = { class: `edit-chip ${result}`, title: text };
    if (!isTraced) return make("span", attributes, `${name}: ${words}`);
    return make("button", { ...attributes, "data-property": name, "aria-pressed": String(name === traced), onclick: () => showTrace(name === traced ? "" : name) }, `${name}: ${words}`);
  });
  const focused = document.activeElement && document.activeElement.dataset.property;
  $("edit-verdicts").replaceChildren(...chips, ...(traced ? [make("button", { onclick: () => showTrace("") }, "Close the trace")] : []));
  if (focused) for (const chip of chips) if (chip.dataset.property === focused) chip.focus();
}

/** Show the trace of a property in the drawing, from its start; with no name, the chart again. */
async function showTrace(name) {
  if ((await say("trace", { property: name })) === undefined) return;
  setMode(!name);
  if (name) $("step").focus();
}

/** Return the innermost state or transition whose first line is at or before a location. */
function itemAt(at) {
  if (!at || !documentOf.states || at.file !== documentOf.file) return null;
  let found = null;
  let line = 0;
  for (const state of documentOf.states) {
    if (state.at.line <= at.line && state.at.line >= line) { found = { kind: "state", id: state.id }; line = state.at.line; }
    state.transitions.forEach((one, index) => { if (one.at.line <= at.line && one.at.line >= line) { found = { kind: "transition", source: state.id, index }; line = one.at.line; } });
  }
  return found;
}

// --- the drawing ----------------------------------------------------------------------------------

const NODES = { state: "s", transition: "t" };
const BORDER = 7; // pixels inside of a state's border from which a transition is drawn
const OUTSIDE = 4; // and outside
let marked = []; // nodes with a class of the editor
let handles = []; // circles; `of`: the node that has them

paint = ((inner) => () => {
  inner();
  if (!isEditing || !documentOf) return;
  for (const [node, name] of marked) node.classList.remove(name);
  marked = [];
  const view = views[0];
  const mark = (what, name) => {
    const drawn = drawnItem(view, what);
    for (const node of (drawn && view.nodes.get(NODES[drawn.kind] + drawn.index)) || []) { node.classList.add(name); marked.push([node, name]); }
    return drawn;
  };
  for (const each of documentOf.findings) if (each.severity !== "note") { const found = itemAt(each.at); if (found) mark(found, "edit-finding"); }
  const drawn = selected && mark(selected, "edit-selected");
  for (const id of also) mark({ kind: "state", id }, "edit-selected");
  showHandles(view, also.length ? null : drawn);
})(paint);

/** Show a new drawing as a person left the old one: zoomed and moved, or whole. */
views[0].look.show = ((inner) => function show(svg) {
  const kept = this.box && this.ownBox !== this.box.join() ? this.box : null;
  inner.call(this, svg);
  if (!isEditing || !svg || !this.width) return;
  const [x, y, w, h] = this.whole;
  if (kept) this.lookAt(kept);
  else {
    const whole = Math.max(this.unit(this.whole), LETTER / MOST);
    if (whole <= LETTER / OVERVIEW) this.centre(x + w / 2, y + h / 2, whole);
    else this.centre(x + w / 2, y, LETTER / LEAST); // its letters are too small: the start, where the initial state is
  }
  if (!kept) this.ownBox = this.box.join();
})(views[0].look.show);

/** Return where the ends of a drawn transition are: the points of its lines next to its states. */
function endsOf(view, one, source) {
  const drawn = drawnItem(view, { kind: "state", id: source });
  const nodes = view.nodes.get(`t${one.drawn}`) || [];
  const paths = nodes.flatMap((node) => [...node.querySelectorAll("path")]).filter((path) => path.closest(".edge"));
  const points = [...new Set(paths)].flatMap((path) => [path.getPointAtLength(0), path.getPointAtLength(path.getTotalLength())]);
  if (!drawn || points.length < 2) return [];
  const take_ = (id) => {
    const found = drawnItem(view, { kind: "state", id });
    const [node] = (found && view.nodes.get(`s${found.index}`)) || [];
    if (!node) return null;
    const { x, y, width, height } = node.getBBox();
    const away = (at) => Math.min(Math.hypot(at.x - Math.max(x, Math.min(at.x, x + width)), at.y - Math.max(y, Math.min(at.y, y + height))) || Infinity, Math.abs(at.x - x), Math.abs(at.x - x - width), Math.abs(at.y - y), Math.abs(at.y - y - height));
    points.sort((one_, other) => away(one_) - away(other));
    return points.shift();
  };
  const ends = [{ how: "source", at: take_(source) }];
  if (one.targets.length === 1) ends.push({ how: "target", at: take_(one.targets[0]) });
  return ends.filter(({ at }) => at);
}

/** Return the radius of a handle in units of the drawing: it keeps its size on the screen. */
const radiusOf = (how) => ((how === "link" ? 8 : 7) * views[0].look.unit()).toFixed(2);

/** Show the handle of the selected state, or those of the ends of the selected transition. */
function showHandles(view, drawn) {
  const [node] = (drawn && !view.frame.hidden && view.nodes.get(NODES[drawn.kind] + drawn.index)) || [];
  if (handles.of === node) {
    for (const each of handles) setAttribute(each, "r", radiusOf(each.dataset.how));
    return;
  }
  for (const each of handles) each.remove();
  handles = [];
  handles.of = node;
  if (!node) return;
  const handle = (how, cx, cy) => shape("circle", { id: how === "link" ? "edit-handle" : `edit-end-${how}`, class: "edit-handle", "data-how": how, cx, cy, r: radiusOf(how) });
  if (drawn.kind === "state") {
    const { x, y, width, height } = node.getBBox();
    if (!["final", "shallow history", "deep history"].includes(itemOf(selected).kind)) handles.push(handle("link", x + width, y + height / 2));
  } else for (const { how, at } of endsOf(view, itemOf(selected), selected.source)) handles.push(handle(how, at.x, at.y));
  node.parentNode.append(...handles);
}

/** Return the state of this file that is drawn at a point. */
function stateAt({ clientX, clientY }) {
  const under = document.elementsFromPoint(clientX, clientY).find((node) => views[0].frame.contains(node) && !node.matches(".edit-handle"));
  const what = under && views[0].meant(under);
  return what && what.kind === "state" ? documentItem(views[0], what) : null;
}

/** Return the state at whose border a point is, from which a transition is drawn. */
function stateAtBorder({ clientX, clientY }) {
  for (const [dx, dy] of [[0, 0], [OUTSIDE, 0], [-OUTSIDE, 0], [0, OUTSIDE], [0, -OUTSIDE]]) {
    const state = stateAt({ clientX: clientX + dx, clientY: clientY + dy });
    const drawn = drawnItem(views[0], state);
    if (!drawn) continue;
    const { left, top, right, bottom } = views[0].nodes.get(`s${drawn.index}`)[0].getBoundingClientRect();
    const border = Math.min(BORDER, (bottom - top) / 5, (right - left) / 5);
    if (Math.min(clientX - left, right - clientX, clientY - top, bottom - clientY) < border) return state;
  }
  return null;
}

/** Draw the line of a drag from where it started; with no event, remove it and its marks. */
function showDrag(event) {
  const overlay = $("edit-overlay");
  overlay.toggleAttribute("hidden", !event);
  for (const node of views[0].frame.querySelectorAll(".edit-drop")) node.classList.remove("edit-drop");
  views[0].frame.classList.toggle("edit-dragging", Boolean(event));
  if (!event) return;
  const to = stateAt(event);
  const drawn = drawnItem(views[0], to);
  if (drawn && to.id !== (drag.how === "move" ? drag.from.id : "")) for (const node of views[0].nodes.get(`s${drawn.index}`) || []) node.classList.add("edit-drop");
  const [line] = overlay.children;
  const { x: x1, y: y1 } = drag.fixed || drag;
  for (const [name, value] of Object.entries({ x1, y1, x2: event.clientX, y2: event.clientY })) line.setAttribute(name, value);
  line.toggleAttribute("hidden", drag.how === "move");
}

views[0].frame.addEventListener("pointerdown", (event) => {
  if (!isEditing || event.button !== 0 || !documentOf || !documentOf.read) return;
  const begin = { x: event.clientX, y: event.clientY, hash: documentOf.hash };
  const { how } = event.target.dataset;
  if (how && handles.includes(event.target)) {
    const other = handles.find((each) => each !== event.target);
    const box = other && other.getBoundingClientRect();
    drag = { ...begin, how, from: selected, fixed: box && { x: box.left + box.width / 2, y: box.top + box.height / 2 } };
  } else {
    const border = stateAtBorder(event);
    const from = border || stateAt(event);
    if (!from) return;
    drag = { ...begin, how: border ? "link" : "move", from };
  }
  event.stopPropagation();
}, true);

window.addEventListener("pointermove", (event) => {
  if (!drag) {
    if (isEditing && documentOf && documentOf.read && views[0].frame.contains(event.target)) views[0].frame.classList.toggle("edit-border", Boolean(stateAtBorder(event)));
    return;
  }
  if (!drag.isMoved && Math.hypot(event.clientX - drag.x, event.clientY - drag.y) < 8) return;
  drag.isMoved = true;
  if (drag.how) showDrag(event);
});

window.addEventListener("pointerup", (event) => {
  const done = drag;
  drag = null;
  if (!done || !done.isMoved) return;
  showDrag(null);
  suppressClick = true;
  setTimeout(() => { suppressClick = false; });
  if (views[0].frame.contains(document.elementFromPoint(event.clientX, event.clientY))) dropped(done, stateAt(event));
});

/** Do what a drag to a state, or to the paper (null), means; it is for the text in which it started. */
function dropped({ how, from, hash }, to) {
  const { id, source, index } = from;
  if (how === "link") { if (to) addTransition(id, to.id, hash); }
  if (how === "target" && to) edit([{ op: "SetTarget", source, index, targets: [to.id] }], () => select(from), { hash });
  if (how === "source" && to && to.id !== source) {
    const one = itemOf(from);
    edit([{ op: "SetSource", source, index, new: to.id }], () => select(transitionLike(to.id, one) || to), { hash });
  }
  if (how !== "move") return;
  const parent = to ? to.id : "";
  const ids = also.length && selectedStates().includes(id) ? selectedStates() : [id];
  const states = ids.map(stateOf);
  if (states.some((state) => !state || state.refines || (to && (to.id === state.id || inside(state.id).includes(to.id))))) return;
  const moving = states.filter((state) => parent !== (state.parent || ""));
  if (moving.length) edit(moving.map((state) => ({ op: "MoveState", state: state.id, parent })), () => { if (ids.length < 2) select({ kind: "state", id }); }, { hash });
}

let suppressClick = false; // after a drag
views[0].frame.addEventListener("click", (event) => {
  if (isEditing && suppressClick) event.stopPropagation();
  isExtending = event.shiftKey || event.ctrlKey || event.metaKey;
}, true);
views[0].frame.addEventListener("dblclick", (event) => {
  if (!isEditing) return;
  event.stopPropagation();
  const what = documentItem(views[0], views[0].meant(event.target));
  if (!what) return;
  selected = what;
  if (what.kind === "state" && foldedStates().has(what.id)) { foldSelected(); return; }
  showEditor();
  editInPlace();
}, true);

// --- hands ----------------------------------------------------------------------------------------

function setMode(toEdit) {
  isEditing = toEdit;
  if (toEdit && ["running", "following"].includes(session.mode.mode)) say("pause");
  if (!toEdit) { chosen = null; showChosen(); for (const [node, name] of marked) node.classList.remove(name); marked = []; showHandles(views[0], null); }
  views[0].look.setFollowing(!toEdit);
  showEditor();
  repaint();
}

/** Select the item before or after the selected one. */
function stepSelection(by) {
  const rows = itemChoices();
  const at = rows.findIndex(([text]) => text === (selected ? JSON.stringify(selected) : ""));
  const [text] = rows[(at + by + rows.length) % rows.length];
  chosen = null;
  select(text ? JSON.parse(text) : null);
}

/** Add the state after or before the last selected one to the selection. */
function extendSelection(by) {
  const ids = documentOf.states.map((each) => each.id);
  const last = also.at(-1) || (selected && selected.kind === "state" && selected.id);
  const next = ids[ids.indexOf(last) + by];
  if (last && next && ![selected.id, ...also].includes(next)) toggle(next);
}

const EDIT_KEYS = {
  n: () => addState("atomic"),
  t: () => { if (selected && selected.kind === "state") openTargets(selected.id); },
  F2: editInPlace,
  Enter: editInPlace,
  Delete: removeSelected,
  c: () => foldSelected(),
  ArrowDown: () => stepSelection(1),
  ArrowUp: () => stepSelection(-1),
  "Shift ArrowDown": () => extendSelection(1),
  "Shift ArrowUp": () => extendSelection(-1),
};

document.addEventListener("keydown", (event) => {
  if (!documentOf) return;
  const isInput = event.target.matches("input:not([type=checkbox]), textarea");
  if (document.querySelector("dialog[open]")) return;
  if ((event.ctrlKey || event.metaKey) && !event.altKey && !isInput) {
    const key = event.key.toLowerCase();
    if (key === "z" && !event.shiftKey) { event.preventDefault(); undo(); }
    if (key === "d" && isEditing) { event.preventDefault(); duplicateSelected(); }
    if (key === "y" || (key === "z" && event.shiftKey)) { event.preventDefault(); redo(); }
    return;
  }
  if (drag && event.key === "Escape") { drag.how = ""; showDrag(null); return; }
  if (!isEditing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (isInput || event.key === "Tab" || event.key === "Escape") return;
  if (event.target.matches("select") && (event.target.id !== "edit-item" || (/^(Arrow| |Home|End)/.test(event.key) && !event.shiftKey))) {
    fill(event.target);
    return;
  }
  if (event.target.matches("button, summary, a") && [" ", "Enter"].includes(event.key)) return;
  const found = EDIT_KEYS[event.shiftKey && event.key.startsWith("Arrow") ? `Shift ${event.key}` : event.key];
  if (["0", "+", "-", "?", "h", "j", "k", "l", "o", "i", "x"].includes(event.key) && !event.target.matches("select")) return; // of the drawing
  event.stopImmediatePropagation();
  if (!found) {
    fill(event.target); // a letter goes to the option that starts with it
    return;
  }
  event.preventDefault();
  found();
}, true);

/** Put the controls of the editor into the page. */
(() => {
  const modes = make("div", { class: "bar", role: "group", "aria-label": "Mode" },
    make("button", { id: "mode-edit", "aria-pressed": "true", onclick: () => setMode(true) }, "Edit"),
    make("button", { id: "mode-run", "aria-pressed": "false", onclick: () => setMode(false) }, "Run"),
    make("button", { id: "edit-undo", title: "Ctrl Z", onclick: undo }, "Undo"),
    make("button", { id: "edit-redo", title: "Ctrl Y", onclick: redo }, "Redo"),
    make("button", { id: "edit-tidy", title: "lay the drawing out anew", onclick: tidy }, "Tidy"));
  $("name").after(modes);
  const kinds = Object.entries(KIND_WORDS).map(([kind, words]) => make("button", { "data-kind": kind, title: kind === "atomic" ? "n" : null, onclick: () => addState(kind) }, words));
  document.querySelector("aside").prepend(make("section", { id: "edit", "aria-label": "Editor" },
    make("div", { id: "edit-unsent", class: "panel", role: "status", hidden: true }),
    make("div", { id: "edit-palette", class: "bar panel", role: "toolbar", "aria-label": "New states" }, ...kinds),
    make("div", { class: "panel" },
      make("label", { class: "edit-row" }, make("span", {}, "selected"), make("select", { id: "edit-item", onchange: (event) => { chosen = null; select(event.target.value ? JSON.parse(event.target.value) : null, true); } })),
      make("div", { id: "edit-targets", class: "bar", hidden: true }),
      make("div", { id: "edit-panel" })),
    make("details", { id: "edit-problems", class: "panel", open: true, hidden: true }, make("summary", {}, make("h2", {}, "Findings")), make("ul", { id: "edit-findings", class: "edit-list" })),
    make("details", { id: "edit-source", class: "panel" }, make("summary", {}, make("h2", {}, "Text")), make("pre", { id: "edit-text", tabindex: "0", role: "group", "aria-label": "Text of the file" }))));
  $("edit").before(make("div", { id: "edit-verdicts", class: "bar", role: "group", "aria-label": "Verdicts of check" }));
  document.querySelector("main").append(make("div", { id: "edit-below", hidden: true }, make("ul", { id: "edit-completions", role: "listbox", "aria-label": "Completions" }), make("div", { id: "edit-preview", role: "status", "aria-label": "Findings of the typed text" })), shape("svg", { id: "edit-overlay", "aria-hidden": "true", hidden: true }, shape("line", { class: "edit-line" })));
  $("drawing").before(make("p", { id: "edit-hint", hidden: true }, "The chart is empty. Press n, or pick a kind of state at the right, to add the first one."));
  const help = $("keys").querySelector("dl");
  help.prepend(...[["n", "new state"], ["t", "transition from the selected state"], ["F2 Enter", "edit the name or label in place"], ["Delete", "remove"], ["c", "fold, unfold"], ["↑ ↓", "select the item before, after"], ["Shift ↑, Shift ↓", "select several states"], ["Ctrl C, Ctrl X, Ctrl V", "copy, cut and paste, as YAML text"], ["Ctrl D", "copy beside"], ["Ctrl Z, Ctrl Y", "undo, redo"]].flatMap(([key, words]) => [make("dt", {}, make("kbd", {}, key)), make("dd", {}, `${words} (edit)`)]));
  views[0].look.setFollowing(false);
  document.body.classList.add("editing");
})();
