"use strict";
// Keys, and the help that lists them.

/** Listen to keys; a row of the table is [{key: what it does}, words]. `pick` takes digits. */
function listenToKeys(table, pick) {
  const acts = new Map(table.flatMap(([row]) => Object.entries(row)));
  const names = { " ": "space", ArrowLeft: "←", ArrowRight: "→", "Shift ArrowLeft": "shift ←", "Shift ArrowRight": "shift →" };
  $("keys").querySelector("dl").replaceChildren(...[...table, [{ "1–9": null }, "machine; with shift: beside"]].flatMap(([row, words]) => [
    make("dt", {}, ...Object.keys(row).flatMap((key, i) => [i ? " " : "", make("kbd", {}, names[key] || key)])), make("dd", {}, words)]));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || $("keys").open) return;
    if (event.key === "Escape" && event.target !== document.body) { event.target.blur(); return; }
    if (event.target.matches("input:not([type=range], [type=checkbox]), select, textarea")) return;
    if (event.target.matches("input") && /^(Arrow|Home|End|Page| )/.test(event.key)) return;
    if (event.key === " " && event.target.matches("button, summary")) return;
    const digit = /^Digit([1-9])$/.exec(event.code);
    if (digit && pick(Number(digit[1]) - 1, event.shiftKey)) { event.preventDefault(); return; }
    const act = acts.get(event.shiftKey && event.key.startsWith("Arrow") ? `Shift ${event.key}` : event.key);
    if (!act) return;
    event.preventDefault();
    act();
  });
}
