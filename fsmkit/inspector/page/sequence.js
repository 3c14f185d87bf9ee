"use strict";
// What went between machines and host: the last messages up to the entry in view, as a sequence diagram.

const MOST_MESSAGES = 500;
const FONTS = "Helvetica, Arial, sans-serif";
const [ROW, HEAD, TIME] = [20, 34, 70]; // height of a message; of the names; width of times
const [CLOSE, FAR] = [66, 170]; // distance of lifelines

class Sequence {
  constructor(session) {
    this.session = session;
  }

  /** Return the last messages up to the entry in view. */
  messages() {
    const { mode, passed } = this.session;
    const found = [];
    for (let n = mode.n; n >= (mode.first || 0) && found.length < MOST_MESSAGES && mode.n - n < KEPT_ENTRIES; n -= 1) {
      for (const each of [...(passed.get(n) || [])].reverse()) found.push({ n, ...each });
    }
    return found.slice(0, MOST_MESSAGES).reverse();
  }

  show() {
    const box = $("sequence");
    const messages = this.messages();
    const width = box.clientWidth;
    const key = JSON.stringify([width, messages.length, messages[0] && messages[0].n, messages.at(-1), palette("ink")]);
    if (this.key === key) return;
    this.key = key;
    const isAtEnd = box.scrollTop + box.clientHeight >= box.scrollHeight - 2 * ROW;
    box.replaceChildren(...(messages.length ? [this.heading(messages, width), this.drawn(messages, width)] : [make("p", { class: "none" }, "no messages yet")]));
    if (isAtEnd) box.scrollTop = box.scrollHeight;
  }

  lanes(messages) {
    const used = new Set(messages.flatMap((each) => [each.from, each.to]));
    return ["", ...this.session.machines.keys()].filter((name) => used.has(name));
  }

  /** Return where each lifeline is, and how wide all are. */
  places(messages, width) {
    const lanes = this.lanes(messages);
    const life = Math.min(Math.max((width - TIME) / lanes.length, CLOSE), FAR);
    return [new Map(lanes.map((name, i) => [name, TIME + life / 2 + i * life])), TIME + lanes.length * life + CLOSE / 2];
  }

  /** Draw the names of the lifelines, by turns higher and lower. */
  names(places) {
    return [...places].map(([name, x], i) => shape("text", { x, y: i % 2 ? 28 : 13, fill: palette("ink"), "font-size": 11, "font-weight": "bold", "text-anchor": "middle" }, name || "host"));
  }

  heading(messages, width) {
    const [places, wide] = this.places(messages, width);
    return shape("svg", { width: wide, height: HEAD, "font-family": FONTS, "aria-hidden": "true" }, ...this.names(places));
  }

  /** Draw messages: queued ones dashed, lost ones crossed out. */
  drawn(messages, width, top = 0) {
    const [places, wide] = this.places(messages, width);
    const height = top + messages.length * ROW + 8;
    const [ink, faint, line, alarm] = ["ink", "faint", "line", "alarm"].map(palette);
    const words = (px, py, text, more = {}) => shape("text", { x: px, y: py, fill: ink, "font-size": 11, ...more }, text);
    const parts = [...places.values()].map((x) => shape("line", { x1: x, y1: top, x2: x, y2: height, stroke: line }));
    if (top) parts.push(...this.names(places));
    messages.forEach((each, i) => {
      const y = top + (i + 1) * ROW - 4;
      const isLost = ["refused", "lost"].includes(each.how);
      const [a, b] = [places.get(each.from), places.get(each.to)];
      const color = isLost ? alarm : ink;
      const side = a === b ? 24 : Math.sign(b - a) * -6;
      const late = each.sentAt === undefined ? "" : `, ${duration(each.at - each.sentAt, this.session.hello.tick_us)} under way`;
      if (i === 0 || messages[i - 1].at !== each.at) parts.push(words(0, y, duration(each.at, this.session.hello.tick_us), { fill: faint }));
      parts.push(shape("path", { d: a === b ? `M${a} ${y - 6}h24v6h-18` : `M${a} ${y}H${b + side}`, fill: "none", stroke: color, "stroke-dasharray": each.how === "queued" ? "6 3" : null }),
        shape("path", { d: a === b ? `M${a} ${y}l7 -3v6z` : `M${b} ${y}l${side} -3v6z`, fill: color }),
        words((a + b) / 2 + (a === b ? 30 : 0), y - 3, `${each.event.map(shown).join(" ")}${late}${isLost ? `: ${each.how}` : ""}`, { "text-anchor": a === b ? "start" : "middle", fill: color }));
      const cross = (a + b) / 2;
      if (isLost) parts.push(shape("path", { d: `M${cross - 4} ${y - 4}l8 8m0 -8l-8 8`, stroke: alarm, "stroke-width": 2 }));
    });
    return shape("svg", { width: wide, height, viewBox: `0 0 ${wide} ${height}`, "font-family": FONTS, role: "img", "aria-label": `${messages.length} messages` }, ...parts);
  }

  asSvg() {
    return new XMLSerializer().serializeToString(this.drawn(this.messages(), Infinity, HEAD));
  }

  asMermaid() {
    const messages = this.messages();
    const lanes = this.lanes(messages);
    const safe = (text) => [...text].map((c) => (/[\p{L}\p{N} _.,=()[\]+-]/u.test(c) ? c : `#${c.codePointAt(0)};`)).join("");
    const lines = messages.map((each) => `  p${lanes.indexOf(each.from)}${["refused", "lost"].includes(each.how) ? "-x" : "->>"}p${lanes.indexOf(each.to)}: ${safe(each.event.map(shown).join(" "))}`);
    return ["sequenceDiagram", ...lanes.map((name, i) => `  participant p${i} as ${safe(name || "host")}`), ...lines, ""].join("\n");
  }
}
