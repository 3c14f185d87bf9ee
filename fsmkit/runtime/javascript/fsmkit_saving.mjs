// Machines as bytes: the layout that every runtime of fsmkit reads and writes, least byte first.

const MAGIC = [0x46, 0x53, 0x4d, 1];
const FAULTS = [null, "microsteps", "internal", "range", "error.*", "invoked"];
const SEND = 0x8000;
const NOTHING = -1;
const SIZES = { B: 1, b: 1, H: 2, h: 2, I: 4, i: 4, Q: 8, q: 8, f: 4, d: 8 };
const METHODS = {
  B: "Uint8", b: "Int8", H: "Uint16", h: "Int16", I: "Uint32", i: "Int32",
  Q: "BigUint64", q: "BigInt64", f: "Float32", d: "Float64",
};

const REMAINDERS = new Uint32Array(256).map((_, byte) => {
  let found = byte;
  for (let bit = 0; bit < 8; bit += 1) found = found & 1 ? (found >>> 1) ^ 0xedb88320 : found >>> 1;
  return found;
});

/** CRC-32 of IEEE 802.3, as in zlib. */
function crc32(bytes) {
  let found = 0xffffffff;
  for (const byte of bytes) found = REMAINDERS[(found ^ byte) & 0xff] ^ (found >>> 8);
  return ~found >>> 0;
}

/** The machine as bytes, timers with the time that they have left at `now`, by default the last call's. */
export function save(machine, now = machine._now) {
  if (machine._busy) throw new Error(`${machine.definition.name} was called from within one of its own steps`);
  if (machine.fault === "exception") {
    throw new RangeError(`${machine.definition.name} was broken off in the midst of a step`);
  }
  const { head, size } = machine.definition.image;
  const bytes = new Uint8Array(MAGIC.length + head.length + size + 4);
  bytes.set([...MAGIC, ...head]);
  new Writer(bytes, MAGIC.length + head.length).machine(machine, now >>> 0);
  new DataView(bytes.buffer).setUint32(bytes.length - 4, crc32(bytes.subarray(0, -4)), true);
  return bytes;
}

/** Go on from what was saved, at a time in ticks; a machine that cannot is as one not started. */
export function restore(machine, saved, now = 0) {
  if (machine._busy) throw new Error(`${machine.definition.name} was called from within one of its own steps`);
  const { name, image } = machine.definition;
  const bytes = Uint8Array.from(saved);
  const start = MAGIC.length + image.head.length;
  const isSealed = bytes.length > start + 4 && MAGIC.every((byte, at) => bytes[at] === byte) &&
    new DataView(bytes.buffer).getUint32(bytes.length - 4, true) === crc32(bytes.subarray(0, -4));
  if (!isSealed) throw new RangeError(`this is no saved ${name}, or damaged`);
  if (image.head.some((byte, at) => bytes[MAGIC.length + at] !== byte)) {
    throw new RangeError(`this was saved by another chart than ${name}`);
  }
  if (bytes.length !== start + image.size + 4) {
    throw new RangeError(`a saved ${name} has another length than ${bytes.length}`);
  }
  try {
    new Reader(bytes, start).machine(machine, now >>> 0);
    if (save(machine, now >>> 0).some((byte, at) => byte !== bytes[at])) {
      throw new RangeError("the saved machine is damaged: no machine is saved like that");
    }
  } catch (error) {
    forget(machine, 0);
    throw error;
  }
}

/** Let a machine be as one that has not been started. */
function forget(machine, now) {
  machine._resetData();
  machine._clear(now);
  machine._running = false;
}

/** Throws where a started machine is never in such states after a macrostep. */
function requireLegal(numbers, image, states, isRunning) {
  numbers.forEach((state, place) => {
    const [region, owner] = image.owners[place];
    let above = numbers[region];
    while (above > owner) above = states[above].parent;
    const isActive = above === owner;
    const rests = image.resting.includes(state) || (!isRunning && image.endings.includes(state));
    if (isActive === (state === 0) || (state && !rests)) {
      throw new RangeError(`the saved machine is damaged: region ${place} is never in state ${state} there`);
    }
  });
}

/** Throws where a history recorded a part of a state. */
function requireRecorded(recorded, image) {
  const held = new Set(image.recorded.filter((_, place) => recorded[place]).map(([history]) => history));
  image.recordedBelow.forEach(([entry, low, high], place) => {
    const isHeld = entry < 0 ? held.has(low) : recorded[entry] >= low && recorded[entry] <= high;
    if (isHeld !== (recorded[place] !== 0)) {
      throw new RangeError("the saved machine is damaged: a history recorded half of a state");
    }
  });
}

class Writer {
  constructor(bytes, at) {
    this.view = new DataView(bytes.buffer);
    this.at = at;
  }

  put(code, value) {
    const isLong = code === "Q" || code === "q";
    const number = isLong ? BigInt(value) : Number.isNaN(value) ? NaN : Number(value); // one NaN, not the bits it was read with
    this.view[`set${METHODS[code]}`](this.at, number, true);
    this.at += SIZES[code];
  }

  machine(machine, now) {
    const { definition } = machine;
    const { image, states } = definition;
    const { fault } = machine;
    this.put("B", Number(machine.running) + 2 * Number(machine.finished));
    this.put("B", FAULTS.indexOf(fault !== null && fault.startsWith("error.") ? "error.*" : fault));
    for (const region of image.regions) this.put("H", deepest(region, (state) => machine._active[state]));
    for (const [history, region] of image.recorded) {
      const path = new Set();
      for (const leaf of machine._history.get(history) ?? []) {
        for (let state = leaf; state !== states[history].parent; state = states[state].parent) path.add(state);
      }
      this.put("H", deepest(image.regions[region], (state) => path.has(state)));
    }
    for (const [place, name, type] of image.values) this.value(type, machine[place][name], image);
    const end = this.at + image.waiting;
    if (machine.running) {
      this.events(machine._queue, definition.queue, image);
      if (image.deferred) this.events(machine._deferred, image.deferred, image);
      if (image.timers) this.timers(machine._timers, now, image);
    }
    this.at = end;
    machine._slots.forEach((child) => {
      const after = this.at + child.definition.image.size;
      if (machine.running && child.running) this.machine(child, now);
      this.at = after;
    });
  }

  value(type, value, image) {
    const [kind, code, ...parts] = type;
    if (kind === "parts") {
      [code, ...parts].forEach((part, at) => this.value(part, value[at], image));
    } else if (kind === "text") {
      const found = image.texts.indexOf(value);
      if (found < 0) throw new RangeError(`the chart nowhere mentions the text ${value}`);
      this.put(code, found);
    } else {
      this.put(code, value);
    }
  }

  event({ event, payload }, image) {
    this.put("H", event + 1);
    const end = this.at + image.payload;
    image.events[event].forEach((type, at) => this.value(type, payload[at], image));
    this.at = end;
  }

  events(waiting, room, image) {
    this.put("B", waiting.length);
    const end = this.at + room * (2 + image.payload);
    for (const one of waiting) this.event(one, image);
    this.at = end;
  }

  timers(timers, now, image) {
    this.put("B", timers.length);
    const end = this.at + image.timers * 6;
    for (const { due, transition } of timers) {
      this.put("I", (due - now) >>> 0);
      this.put("H", transition === NOTHING ? SEND : transition);
    }
    this.at = end;
    for (const timer of timers.filter(({ transition }) => transition === NOTHING)) {
      const isSame = ([route, slots]) => route === timer.route && slots.join() === timer.slots.join();
      this.put("H", image.routes.findIndex(isSame));
      this.put("H", image.ids.indexOf(timer.mark));
      this.put("H", image.peers.indexOf(timer.peer));
      this.event(timer, image);
    }
  }
}

/** The last of some states for which something holds, 0 for none. */
function deepest(states, holds) {
  return states.filter(holds).pop() ?? 0;
}

class Reader {
  constructor(bytes, at) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer);
    this.at = at;
  }

  get(code) {
    const value = this.view[`get${METHODS[code]}`](this.at, true);
    this.at += SIZES[code];
    return value;
  }

  /** A number that is not over a bound. */
  count(code, most) {
    const value = this.get(code);
    if (value > most) throw new RangeError(`the saved machine is damaged: ${value} is over ${most}`);
    return value;
  }

  state(states) {
    const state = this.get("H");
    if (state && !states.includes(state)) throw new RangeError(`the saved machine is damaged: no state ${state}`);
    return state;
  }

  machine(machine, now) {
    const { definition } = machine;
    const { image, states } = definition;
    forget(machine, now);
    const status = this.count("B", 2), fault = this.count("B", FAULTS.length - 1);
    if (fault && (status || !image.canStop)) throw new RangeError("the saved machine is damaged: it has stopped, and yet runs or is finished");
    const numbers = image.regions.map((region) => this.state(region));
    const recorded = image.recorded.map(([, region]) => this.state(image.regions[region]));
    const hasEnded = status === 2 && !image.endings.includes(numbers[0]);
    if (hasEnded || (status !== 0 || fault !== 0) !== [...numbers, ...recorded].some((state) => state)) {
      throw new RangeError("the saved machine is damaged: it is in no such state when it has that status");
    }
    if (status || fault) requireLegal(numbers, image, states, status === 1);
    for (const number of numbers) {
      for (let state = number; state > 0; state = states[state].parent) machine._active[state] = true;
    }
    const held = new Map();
    requireRecorded(recorded, image);
    for (const [place, [history]] of image.recorded.entries()) {
      const state = recorded[place];
      if (state && !image.recordable[place].includes(state)) {
        throw new RangeError(`the saved machine is damaged: a history does not record state ${state}`);
      }
      if (state) held.set(history, [...(held.get(history) ?? []), state]);
    }
    for (const [history, found] of held) {
      const { parent, isDeep } = states[history];
      const isUnread = machine._active[parent] && states[parent].forgotten.includes(history);
      if (isUnread) continue;
      const kept = isDeep ? found.filter((state) => states[state].isLeaf)
        : states[parent].kind === "parallel" ? states[parent].children : found;
      machine._history.set(history, [...kept].sort((a, b) => a - b));
    }
    for (const [place, name, type] of image.values) machine[place][name] = this.value(type, image);
    machine._queue = this.events(definition.queue, image);
    machine._deferred = image.deferred ? this.events(image.deferred, image) : [];
    machine._timers = image.timers ? this.timers(now, image, definition, machine._active) : [];
    for (const child of machine._slots) {
      const after = this.at + child.definition.image.size;
      if (this.bytes.subarray(this.at, after).some((byte) => byte)) this.machine(child, now);
      else forget(child, now);
      this.at = after;
    }
    machine._running = status === 1;
    machine._finished = status === 2;
    machine._fault = FAULTS[fault];
  }

  value(type, image) {
    const [kind, code, ...rest] = type;
    if (kind === "parts") return [code, ...rest].map((part) => this.value(part, image));
    const found = this.get(code);
    if (kind === "real") return found;
    const [lo, hi, known] = kind === "text" ? [0, image.texts.length - 1] : rest;
    if (found < lo || found > hi) throw new RangeError(`the saved machine is damaged: ${found} is outside ${lo}..${hi}`);
    if (known && !known.includes(Number(found))) throw new RangeError(`the saved machine is damaged: ${found} is no member of its enumeration`);
    if (kind === "text") return image.texts[found];
    if (kind === "bool") return found === 1;
    return typeof lo === "bigint" ? BigInt(found) : Number(found);
  }

  event(image) {
    const number = this.count("H", image.events.length);
    const end = this.at + image.payload;
    const payload = number ? image.events[number - 1].map((type) => this.value(type, image)) : [];
    this.at = end;
    return number ? { event: number - 1, payload } : null;
  }

  events(room, image) {
    const count = this.count("B", room);
    const found = Array.from({ length: room }, () => this.event(image));
    if (found.some((event, at) => (event === null) === at < count)) {
      throw new RangeError("the saved machine is damaged: a queue does not hold what it says");
    }
    return found.slice(0, count);
  }

  timers(now, image, { transitions, states }, active) {
    const count = this.count("B", image.timers);
    const pairs = Array.from({ length: image.timers }, () => [this.get("I"), this.get("H")]).slice(0, count);
    const sends = [];
    for (let place = 0; place < image.delayed; place += 1) {
      const [route, mark, peer] = [this.get("H"), this.get("H"), this.get("H")];
      const event = this.event(image);
      if (event !== null) sends.push({ ...event, route, mark, peer });
    }
    const armed = new Set();
    return pairs.map(([left, what], place) => {
      const due = (now + left) >>> 0;
      const after = place > 0 ? (left | 0) - (pairs[place - 1][0] | 0) : 0;
      if (after < 0 || after >= 2 ** 31) {
        throw new RangeError("the saved machine is damaged: its timers are in another order");
      }
      if (what !== SEND) {
        const source = what < transitions.length ? transitions[what].source : 0;
        if (!states[source].timed?.includes(what) || !active[source] || armed.has(what)) {
          throw new RangeError(`the saved machine is damaged: transition ${what} has no timer in these states`);
        }
        armed.add(what);
        return { transition: what, due };
      }
      const send = sends.shift();
      if (!send || !image.routes[send.route] || send.mark >= image.ids.length || send.peer >= image.peers.length) {
        throw new RangeError("the saved machine is damaged: a delayed event is none");
      }
      const [route, slots] = image.routes[send.route];
      const { event, payload } = send;
      const [mark, peer] = [image.ids[send.mark], image.peers[send.peer]];
      return { transition: NOTHING, event, payload, mark, route, slots, peer, due };
    });
  }
}
