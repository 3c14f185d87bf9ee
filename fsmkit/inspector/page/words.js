"use strict";
// Values, times and steps as people read them.

/** Return a value as people read it. */
function shown(value) {
  if (value === undefined || value === null) return "";
  if (Array.isArray(value)) return `[${value.map(shown).join(" ")}]`;
  if (typeof value === "object") {
    if ("int" in value && Object.keys(value).length === 1) return value.int;
    if ("float" in value && Object.keys(value).length === 1) return value.float;
    return `{${Object.entries(value).map(([k, v]) => `${k}: ${shown(v)}`).join(", ")}}`;
  }
  return String(value);
}

/** Return ticks as a duration. */
function duration(ticks, tickUs) {
  const us = ticks * tickUs;
  if (us % 1000 !== 0 && Math.abs(us) < 1e6) return `${us} us`;
  return Math.abs(us) < 1e6 ? `${us / 1000} ms` : `${(us / 1e6).toFixed(3)} s`;
}

function stepText(message, chart) {
  return `${causeText(message.cause, chart)}${message.on ? ` → ${message.on.join(" ")}` : ""}`;
}

/** Return the cause of a step in words. */
function causeText(cause, chart) {
  const [kind, ...rest] = cause;
  if (kind === "timeout") {
    const transition = chart && chart.transitions[rest[0]];
    return transition ? `${transition.source}: ${triggerOf(transition)}` : `timeout ${rest[0]}`;
  }
  return kind === "event" ? rest.map(shown).join(" ") : [kind, ...rest.map(shown)].join(" ");
}

/** Return the trigger of a transition without its guard and actions. */
/** The changes by a client: inputs, data, and the results of operations from here on. */
function changesOf({ inputs, data, results }) {
  const values = Object.entries({ ...inputs, ...data }).map(([name, value]) => `${name} = ${shown(value)}`);
  const returned = Object.entries(results || {}).map(([name, each]) => `${name} returns ${each.map(shown).join(", ")}`);
  return [...(values.length ? [`set ${values.join(", ")}`] : []), ...returned].join("; ");
}

function triggerOf(transition) {
  return transition.label.split(/ \[| \/ |^\/ /)[0] || "at once";
}

function pointText(point) {
  const condition = point.if ? ` if ${point.if}` : "";
  return `${point.on} ${point.m ? `${point.m}: ` : ""}${point.what ?? ""}${condition}`;
}

/** Return where the session stands, and why. */
function modeText(session) {
  const { mode, points, lost } = session;
  const [kind, ...rest] = mode.why || [];
  const at = `entry ${mode.n} of ${mode.head}${lost ? `; ${lost} messages lost` : ""}`;
  if (mode.mode === "running") return `running, ${at}`;
  if (mode.mode === "following") return `following, ${at}`;
  const isFrozen = mode.mode === "frozen";
  const stands = isFrozen ? "frozen" : "stopped";
  const point = points.get(rest[0]);
  switch (kind) {
    case "breakpoint": return `${stands} at breakpoint ${rest[0]}${point ? ` (${pointText(point)})` : ""}, ${at}`;
    case "fault": return `${stands} by the fault ${rest.join(" of ")}, ${at}`;
    case "property": return `${at}: the end of the trace of ${rest[0]}${rest[1] === "loop" ? `, which from entry ${rest[2]} on goes round for ever` : ""}`;
    case "reloaded": return `loaded anew, ${rest.length ? `the first entry that differs is ${rest[0]}` : "all as before"}${rest[1] ? `; not done again from there on: ${rest[1]}` : ""}, ${at}`;
    case "end": return `the end of the recording, ${at}`;
    case "until": return `${stands}: ${rest[0]}, ${at}`;
    case "idle": return `nothing is due, ${at}`;
    default: return `${isFrozen ? "frozen, while it goes on" : "paused"}, ${at}`;
  }
}

/** Whether the session stands at something that wants to be looked at. */
const isAlarm = (mode) => ["breakpoint", "fault", "property"].includes((mode.why || [])[0]);
