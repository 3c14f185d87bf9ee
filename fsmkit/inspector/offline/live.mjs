// Messages of the protocol `fsmkit.live`: as fsmkit/runtime/live/steps.py and values.py make them.

import { isBig, leaves, partTypes } from "./fsmkit_system.mjs";

/** Ticks: the same in fsmkit/language/types.py. */
export const LONGEST_DURATION = 2 ** 31 - 1 - 2 ** 27;

/** The number of a member of an enumeration. */
export function numberOf(type, member) {
  const at = type.members.indexOf(member);
  return type.numbers ? type.numbers[at] : at;
}

/** A value for JSON: members of enumerations by name, records as objects; without a type as it is. */
export function toJson(value, type = null) {
  if (type !== null && type.kind === "enum") return type.members[type.numbers ? type.numbers.indexOf(value) : value];
  if (type !== null && type.kind === "record") {
    return Object.fromEntries(type.fields.map((field, at) => [field.name, toJson(value[at], field.type)]));
  }
  if (Array.isArray(value)) return value.map((part) => toJson(part, type === null ? null : type.of));
  if (typeof value === "bigint") {
    const isSafe = Number.MIN_SAFE_INTEGER <= value && value <= Number.MAX_SAFE_INTEGER;
    return isSafe ? Number(value) : { int: String(value) };
  }
  if (typeof value === "number" && !Number.isFinite(value)) {
    return { float: Number.isNaN(value) ? "nan" : value < 0 ? "-inf" : "inf" };
  }
  return value;
}

/** Format a value for an error message. */
function repr(value) {
  if (value === null) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  return typeof value === "string" ? `'${value}'` : JSON.stringify(value);
}

/** Return the value of a type from JSON; throws `TypeError` with the reason if it is invalid. */
export function fromJson(found, type) {
  const isObject = typeof found === "object" && found !== null && !Array.isArray(found);
  const only = isObject && Object.keys(found).length === 1 ? Object.keys(found)[0] : null;
  switch (type.kind) {
    case "bool":
      if (typeof found === "boolean") return found;
      if (found === 0 || found === 1) return found === 1;
      break;
    case "int": {
      const isWritten = only === "int" && /^\s*[+-]?\d{1,29}\s*$/.test(found.int);
      if (!isWritten && !Number.isInteger(found)) break;
      const value = BigInt(isWritten ? found.int.trim().replace(/^\+/, "") : found);
      const [lo, hi] = [type.lo, type.hi].map((end) => BigInt(typeof end === "object" ? end.int : end));
      if (value < lo || value > hi) throw new TypeError(`is outside \`${lo}..${hi}\`: ${value}`);
      return isBig(type) ? value : Number(value);
    }
    case "float":
      if (typeof found === "number") return found;
      if (only === "float" && ["nan", "inf", "-inf"].includes(found.float)) {
        return { nan: NaN, inf: Infinity, "-inf": -Infinity }[found.float];
      }
      break;
    case "enum":
      if (typeof found === "string" && type.members.includes(found)) return numberOf(type, found);
      if (Number.isInteger(found) && (type.numbers ? type.numbers.includes(found) : found >= 0 && found < type.members.length)) return found;
      throw new TypeError(`is no member of \`${type.name}\` (${type.members.join(", ")}): ${repr(found)}`);
    case "duration":
      if (Number.isInteger(found) && found >= 0 && found <= LONGEST_DURATION) return found;
      break;
    case "array":
    case "record": {
      const types = partTypes(type);
      if (type.kind === "record" && isObject) {
        const names = type.fields.map(({ name }) => name);
        if (Object.keys(found).sort().join("\n") !== [...names].sort().join("\n")) {
          throw new TypeError(`is \`${type.name}\`, whose fields are ${[...names].sort().join(", ")}`);
        }
        return type.fields.map((field) => fromJson(found[field.name], field.type));
      }
      if (Array.isArray(found) && found.length === types.length) return found.map((part, at) => fromJson(part, types[at]));
      throw new TypeError(`is \`${type.name}\`, a sequence of ${types.length} values`);
    }
    default:
      if (typeof found === "string") return found;
  }
  throw new TypeError(`is no \`${type.name}\`: ${repr(found)}`);
}

/** A value as a machine holds it, of JSON without names: members are numbers, records arrays. */
function fromRaw(found, type) {
  const types = partTypes(type);
  if (types !== null) return found.map((part, at) => fromRaw(part, types[at]));
  if (type.kind === "int") return isBig(type) ? BigInt(found.int ?? found) : Number(found.int ?? found);
  if (type.kind === "float" && typeof found === "object") return { nan: NaN, inf: Infinity, "-inf": -Infinity }[found.float];
  return found;
}

/** Return the snapshot that `fsmkit.inspector.scenarios` has written. */
export function snapshotFrom(chart, definition, found) {
  const { states, invocations } = definition;
  const occurrence = ([event, ...payload]) => ({ event, payload: payload.map((value, at) => fromRaw(value, chart.events[event].fields[at].type)) });
  const values = (variables, given) => {
    const held = Object.create(null);
    variables.forEach(({ name, type }, at) => { held[name] = fromRaw(given[at], type); });
    return held;
  };
  const timer = ({ sent, ...rest }) => (sent === undefined ? rest : { ...rest, ...occurrence(sent), transition: -1 });
  const active = new Set(found.active);
  return {
    active: states.map((_, state) => active.has(state)),
    data: values(chart.data, found.data), outputs: values(chart.outputs, found.outputs), inputs: values(chart.inputs, found.inputs),
    history: new Map(found.history), queue: found.queue.map(occurrence), deferred: found.deferred.map(occurrence), timers: found.timers.map(timer),
    now: found.now, running: found.running, finished: found.finished, fault: found.fault,
    invoked: found.invoked.map((child, slot) => child && snapshotFrom(chart.invocations[slot].chart, invocations[slot].definition, child)),
  };
}

// --- rows -------------------------------------------------------------------------------------------

/** The name of an event and the values of its fields. */
export function rowOfEvent(chart, { event, payload }) {
  const { name, fields } = chart.events[event];
  return [name, ...fields.map(({ type }, at) => toJson(payload[at], type))];
}

function rowOfCause(chart, [word, what]) {
  if (word === "event" || word === "delayed") return [word, ...rowOfEvent(chart, what)];
  return what === undefined ? [word] : [word, what];
}

/** An effect as the words of its line in a trace, values as JSON. */
function rowOf(chart, { states }, [word, ...rest]) {
  switch (word) {
    case "-":
    case "+":
      return [word, states[rest[0]].id];
    case "op": {
      const [name, passed, hasResult, result] = rest;
      const { parameters, result: type } = chart.operations.find((each) => each.name === name);
      return ["op", name, ...passed.map((value, at) => toJson(value, parameters[at].type)), ...(hasResult ? ["=", toJson(result, type)] : [])];
    }
    case "out":
    case "raise":
    case "send": {
      const [event, payload, peer] = rest;
      const row = rowOfEvent(chart, { event, payload });
      return peer === undefined || peer === null ? [word, ...row] : ["out to", peer, ...row];
    }
    case "delay":
      return ["delay", rest[2], ...rowOfEvent(chart, { event: rest[0], payload: rest[1] })];
    case "log":
      return ["log", rest[0], ...rest[1].map((value) => toJson(value))];
    case "reply":
      return ["reply", toJson(rest[0])];
    case "unhandled":
    case "deferred":
      return [word, chart.events[rest[0]].name];
    default:
      return [word, ...rest];
  }
}

/** Return effects as rows, with all steps of invoked machines. */
export function rowsOf(chart, definition, rows) {
  return rows.map((row) => {
    if (row[0] !== "in") return rowOf(chart, definition, row);
    const inner = chart.invocations[row[1]].chart, { definition: own } = definition.invocations[row[1]];
    const { at, cause, rows: within, on } = row[2];
    return ["in", chart.invocations[row[1]].id, { at, cause: rowOfCause(inner, cause), do: rowsOf(inner, own, within), on }];
  });
}

// --- messages -----------------------------------------------------------------------------------------

function isSame(one, other) {
  if (Array.isArray(one)) return one.every((part, at) => isSame(part, other[at]));
  return Object.is(one, other);
}

function timersOf(chart, timers) {
  return timers.map((timer) => [timer.transition >= 0 ? timer.transition : chart.events[timer.event].name, timer.due]);
}

function rowsOfQueue(chart, queue) {
  return queue.map((occurrence) => rowOfEvent(chart, occurrence));
}

/** `before` (the start), `running`, `finished` or `fault`. */
export function statusOf({ running, fault, finished }) {
  if (running) return "running";
  return fault !== null ? "fault" : finished ? "finished" : "before";
}

/** Return a macrostep as a message, with all state that it changed. */
export function stepOf(chart, definition, machine, n, { at, cause, rows, before, after }) {
  const message = { k: "step", m: machine, n, at, cause: rowOfCause(chart, cause), do: rowsOf(chart, definition, rows) };
  const put = (key, read) => {
    const [old, now] = [read(before), read(after)];
    if (JSON.stringify(old) !== JSON.stringify(now)) message[key] = now;
  };
  put("on", (snapshot) => leaves(definition, snapshot));
  const changed = Object.create(null);
  for (const place of ["data", "outputs"]) {
    for (const { name, type } of chart[place]) {
      if (!isSame(before[place][name], after[place][name])) changed[name] = toJson(after[place][name], type);
    }
  }
  if (Object.keys(changed).length) message.set = changed;
  put("timers", ({ timers }) => timersOf(chart, timers));
  put("queue", ({ queue }) => rowsOfQueue(chart, queue));
  put("deferred", ({ deferred }) => rowsOfQueue(chart, deferred));
  put("status", statusOf);
  if (after.fault !== null) message.fault = after.fault;
  return message;
}

/** Return the effects of each microstep of a macrostep. */
export function microstepsOf(chart, definition, { rows, marks }) {
  const { states } = definition;
  const of = (part, word) => part.filter((row) => row[0] === word).map((row) => states[row[1]].id);
  const ends = marks.length ? marks : [{ transitions: [], from: 0, to: 0 }];
  const last = ends[ends.length - 1];
  const all = last.to < rows.length ? [...ends, { transitions: [], from: last.to, to: rows.length }] : ends;
  return all.filter(({ from, to, transitions }) => to > from || transitions.length).map(({ transitions, from, to }) => {
    const part = rows.slice(from, to);
    return { transitions, exited: of(part, "-"), entered: of(part, "+"), do: rowsOf(chart, definition, part) };
  });
}

function byName(variables, values) {
  return Object.fromEntries(variables.map(({ name, type }) => [name, toJson(values[name], type)]));
}

/** Return the state of a machine as a message. */
export function stateOf(chart, definition, machine, n, snapshot, at) {
  const message = {
    k: "state", m: machine, n, at,
    on: definition.states.filter((_, state) => state > 0 && snapshot.active[state]).map(({ id }) => id),
    data: byName(chart.data, snapshot.data), inputs: byName(chart.inputs, snapshot.inputs), outputs: byName(chart.outputs, snapshot.outputs),
    queue: rowsOfQueue(chart, snapshot.queue), deferred: rowsOfQueue(chart, snapshot.deferred), timers: timersOf(chart, snapshot.timers),
    status: statusOf(snapshot),
  };
  if (snapshot.fault !== null) message.fault = snapshot.fault;
  const invoked = Object.create(null);
  chart.invocations.forEach(({ id }, slot) => {
    if (snapshot.invoked[slot] !== null) invoked[id] = leaves(definition.invocations[slot].definition, snapshot.invoked[slot]);
  });
  if (Object.keys(invoked).length) message.invoked = invoked;
  return message;
}

// --- traces -------------------------------------------------------------------------------------------

const WITHIN = ["delayed", "within", "cancelled"];

/** The lines of a macrostep, as every runtime traces it. */
export function linesOf(rt, definition, { at, cause, rows, on }) {
  const isWhole = !WITHIN.includes(cause[0]);
  const lines = isWhole ? [`@${at >>> 0} > ${rt.causeText(definition, cause)}`] : [];
  for (const row of rows) {
    if (row[0] === "in") {
      const { id, definition: own } = definition.invocations[row[1]];
      lines.push(...linesOf(rt, own, row[2]).map((line) => `${id}: ${line}`));
    } else {
      const line = rt.effectLine(definition, row);
      if (line !== null) lines.push(line);
    }
  }
  return isWhole ? [...lines, ["=", ...on].join(" ")] : lines;
}
