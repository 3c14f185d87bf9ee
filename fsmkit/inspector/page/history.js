"use strict";
// What happened: a lane for each machine and region, coloured by its states, and the entries around the one in view.

const LANE = 16; // pixels
const GUTTER = 96; // the width of the names of machines and regions
const EARLIER = 60; // entries that are listed before the one in view
const LATER = 30;

class Lanes {
  constructor(session, seek) {
    this.session = session;
    this.canvas = $("lanes");
    let isDown = false;
    const go = (event) => {
      const n = this.at(event.clientX - this.canvas.getBoundingClientRect().left);
      if (n !== undefined) seek(n);
    };
    this.canvas.addEventListener("pointerdown", (event) => { isDown = true; this.canvas.setPointerCapture(event.pointerId); go(event); });
    this.canvas.addEventListener("pointermove", (event) => { if (isDown) go(event); });
    for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, () => { isDown = false; });
  }

  /** Return the entry below a place of the canvas. */
  at(x) {
    if (!this.window) return undefined;
    const { from, last, left, unit } = this.window;
    return Math.min(Math.max(from + Math.floor((x - left) / unit), from), last);
  }

  /** Return the lanes: one for each region of a machine, and one for its states outside of regions. */
  all() {
    const { machines, charts } = this.session;
    return [...machines.values()].flatMap((machine) => {
      const chart = charts.get(machine.hash);
      const regions = chart ? regionsOf(chart) : [null];
      // one state around all regions is always active, so it says nothing
      const shown = machines.size === 1 && regions.length > 1 && chart.states.filter((state) => state.parent !== null && regionOf(chart, state.id) === null).length < 2 ? regions.slice(1) : regions;
      return shown.map((region) => ({ machine, chart, region, name: region ?? machine.name, indent: machines.size > 1 && region !== null ? 8 : 0 }));
    });
  }

  show() {
    const { session, canvas } = this;
    const all = this.all();
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.parentElement.clientWidth;
    const height = all.length * LANE + 2;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      canvas.style.height = `${height}px`;
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    const { first = 0, head, n } = session.mode;
    const left = all.length > 1 ? Math.min(GUTTER, width / 4) : 0;
    const most = Math.max(1, Math.floor((width - left) / 6));
    const last = Math.max(Math.min(head, Math.max(n + Math.floor(most / 4), first + most - 1)), first);
    const from = Math.max(first, last - most + 1);
    const unit = Math.min((width - left) / (last - from + 1), 60);
    this.window = { from, last, left, unit };
    const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
    const isForced = matchMedia("(forced-colors: active)").matches;
    const [ink, faint, mark, taken] = [palette("ink"), palette("faint"), palette("active-line"), palette("taken")];
    const stays = this.stays(all, from, last);
    all.forEach(({ machine, name, indent, chart, region }, lane) => {
      const y = 1 + lane * LANE;
      if (left) {
        pen.fillStyle = faint;
        pen.fillText(clipped(pen, name, left - indent - 6), indent, y + LANE / 2);
      }
      for (const { on, at, end } of stays[lane]) {
        const [x, right] = [left + (at - from) * unit, left + (end - from) * unit];
        pen.fillStyle = isForced ? palette("paper") : hue(on, isDark);
        pen.fillRect(x, y, right - x, LANE - 3);
        if (isForced) {
          pen.strokeStyle = ink;
          pen.lineWidth = 1;
          pen.strokeRect(x + 0.5, y + 0.5, right - x - 1, LANE - 4);
        }
        pen.fillStyle = ink;
        if (right - x > 28) pen.fillText(clipped(pen, on, right - x - 6), x + 3, y + LANE / 2 - 1);
      }
      pen.fillStyle = taken;
      const isFirst = all.findIndex((each) => each.machine === machine) === lane;
      for (let at = from; at <= last; at += 1) {
        const entry = session.entries.get(at);
        if (!entry || entry.m !== machine.name) continue;
        const isIn = entry.moves.some(([, id]) => regionOf(chart, id) === region);
        if (isIn || (isFirst && !entry.moves.length)) pen.fillRect(left + (at - from) * unit, y + LANE - 3, Math.max(unit - 2, 1), 2);
      }
    });
    if (n >= from && n <= last) {
      pen.strokeStyle = mark;
      pen.lineWidth = 2;
      pen.strokeRect(left + (n - from) * unit + 1, 1, Math.max(unit - 2, 2), height - 2);
    }
  }

  /** Return for each lane what is active in it, from which entry on and until which. */
  stays(all, from, last) {
    const courses = new Map(); // machine: what is active in it, from which entry on
    for (const { machine, chart } of all) if (!courses.has(machine)) courses.set(machine, this.course(machine, chart, from, last));
    return all.map(({ machine, chart, region }) => {
      const found = [];
      for (const { at, on } of courses.get(machine)) {
        const name = on && chart ? innermost(chart, on, region) : [...(on || [])].at(-1);
        if (found.length) {
          const before = found.at(-1);
          if (before.on === name) continue;
          before.end = at;
        }
        found.push({ on: name, at, end: last + 1 });
      }
      return found.filter(({ on }) => on !== undefined);
    });
  }

  /**
   * Return what is active in a machine, from which entry on; null where that is not known.
   *
   * What was active before the first step follows from what that step entered and left. Where
   * there is no step it is what is active now, as the entry in view is one of these.
   */
  course(machine, chart, from, last) {
    const { entries } = this.session;
    const whole = (leaves) => new Set(leaves.flatMap((id) => (chart ? pathTo(chart, id) : [id])));
    const steps = [];
    for (let at = from; at <= last; at += 1) {
      const entry = entries.get(at);
      if (entry && entry.m === machine.name && entry.on) steps.push(entry);
    }
    let on = machine.state && machine.isKnown ? new Set(machine.state.on) : null;
    if (steps.length) {
      on = whole(steps[0].on);
      for (const [word, id] of [...steps[0].moves].reverse()) {
        if (word === "+") on.delete(id);
        else on.add(id);
      }
    }
    return [{ at: from, on }, ...steps.map(({ n, on: leaves }) => ({ at: n, on: whole(leaves) }))];
  }
}

/** Return a colour for a name: the same each time. */
function hue(name, isDark) {
  let sum = 7;
  for (let i = 0; i < name.length; i += 1) sum = (sum * 31 + name.charCodeAt(i)) % 360;
  return `hsl(${sum} ${isDark ? "38% 27%" : "60% 86%"})`;
}

function clipped(pen, text, width) {
  if (pen.measureText(text).width <= width) return text;
  let length = text.length;
  while (length > 0 && pen.measureText(`${text.slice(0, length)}…`).width > width) length -= 1;
  return length ? `${text.slice(0, length)}…` : "";
}

/** The entries around the one in view; rebuilt only if they change. */
class Entries {
  constructor(session, seek) {
    this.session = session;
    this.seek = seek;
    this.rows = new Map(); // n: its row
  }

  show() {
    const { first = 0, head, n } = this.session.mode;
    const scrub = $("scrub");
    setAttribute(scrub, "min", first);
    setAttribute(scrub, "max", head);
    if (document.activeElement !== scrub || !this.isScrubbing) scrub.value = n;
    const list = $("entries");
    if (list.hidden) return;
    const [from, to] = [Math.max(first, n - EARLIER), Math.min(head, n + LATER)];
    const wanted = [];
    for (let at = from; at <= to; at += 1) {
      const entry = this.session.entries.get(at);
      if (!entry) continue;
      let row = this.rows.get(at);
      if (!row || row.entry !== entry) {
        const who = this.session.machines.size > 1 ? `${entry.m}  ` : "";
        row = { entry, node: make("li", { onclick: () => this.seek(at) }, `${at}  ${duration(entry.at, this.session.hello.tick_us)}  ${who}${entry.text}`) };
        this.rows.set(at, row);
      }
      setAttribute(row.node, "class", at === n ? "shown" : "");
      wanted.push(row.node);
    }
    for (const at of this.rows.keys()) if (at < from || at > to) this.rows.delete(at);
    const isSame = list.childElementCount === wanted.length && wanted.every((node, i) => list.children[i] === node);
    if (!isSame) list.replaceChildren(...wanted);
    const here = list.querySelector(".shown");
    if (here && (this.at !== n || !isSame)) list.scrollTop = here.offsetTop - list.offsetTop - list.clientHeight / 2;
    this.at = n;
  }
}
