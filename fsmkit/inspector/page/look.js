"use strict";
// The visible part of a drawing: whole, followed, zoomed or moved; with a small map of the drawing.

const LETTER = 10; // units of the letters in a drawing: `SMALL` of diagram/states/dot
const LEAST = 11; // the size of legible letters, in pixels
const OVERVIEW = 8; // the size of letters down to which a drawing is shown whole, in pixels
const MOST = 17;
const MAP_GAP = 6; // pixels between the small map and the frame
const REST = 500; // milliseconds between two moves of a following view
const LASTING = 1000; // milliseconds for which a state that was left is still followed

class Look {
  constructor(frame, changed) {
    this.frame = frame;
    this.changed = changed;
    this.svg = null;
    this.isFollowing = true;
    this.moved = 0;
    this.recent = new Map(); // box of a state: when it was last active
    this.map = make("canvas", { class: "map", "aria-hidden": "true" });
    [this.width, this.height] = [0, 0]; // the size of the frame, cached because reading it costs a layout
    new ResizeObserver(() => { [this.width, this.height] = [frame.clientWidth, frame.clientHeight]; changed(); }).observe(frame);
    this.listen();
  }

  /** Take another drawing into the frame. */
  show(svg) {
    this.svg = svg;
    this.frame.replaceChildren(...(svg ? [svg, this.map] : []));
    this.recent.clear();
    this.boxes = null;
    if (!svg) return;
    this.whole = svg.getAttribute("viewBox").split(/\s+/).map(Number);
    this.lookAt([...this.whole]);
  }

  /** The positions of states and arrows, once the drawing is on the page. */
  measure(nodesOf) {
    if (this.boxes || !this.width) return;
    const root = this.svg.querySelector("g");
    const shift = root && root.transform.baseVal.consolidate();
    const [dx, dy] = shift ? [shift.matrix.e, shift.matrix.f] : [0, 0];
    this.boxes = new Map();
    for (const [key, [node]] of nodesOf) {
      const { x, y, width, height } = node.getBBox();
      if (width || height) this.boxes.set(key, { x: x + dx, y: y + dy, right: x + dx + width, bottom: y + dy + height });
    }
    fitTexts(this.svg);
    this.texts = [...this.svg.querySelectorAll("text")].map((text) => text.getBBox()).map(({ x, y, width, height }) => ({ x: x + dx, y: y + dy, right: x + dx + width, bottom: y + dy + height }));
  }

  /** Units of the drawing in a pixel, if the box were shown in the frame. */
  unit(box = this.box) {
    return Math.max(box[2] / this.width, box[3] / this.height);
  }

  lookAt(box) {
    this.box = box;
    this.svg.setAttribute("viewBox", box.map((v) => v.toFixed(2)).join(" "));
  }

  /** Show so many units in a pixel around a point; no more empty paper than must be. */
  centre(x, y, unit) {
    const { width: clientWidth, height: clientHeight } = this;
    const side = (at, size, from, length) => (size >= length ? from + (length - size) / 2 : Math.min(Math.max(at - size / 2, from), from + length - size));
    const [w, h] = [clientWidth * unit, clientHeight * unit];
    const [wx, wy, ww, wh] = this.whole;
    this.lookAt([side(x, w, wx, ww), side(y, h, wy, wh), w, h]);
  }

  /**
   * Keep in view what is active, was so in the last second, and the last arrow: at most twice a
   * second, and only where it has left the middle. Letters stay readable.
   */
  follow(leaves, arrow) {
    const { width: clientWidth, height: clientHeight } = this;
    if (!this.isFollowing || !this.boxes || !clientWidth || !clientHeight) return;
    const now = performance.now();
    for (const key of leaves) if (this.boxes.has(key)) this.recent.set(this.boxes.get(key), now);
    for (const [box, at] of this.recent) if (now - at > LASTING) this.recent.delete(box);
    const unit = Math.max(this.unit(this.whole), LETTER / MOST);
    if (unit <= LETTER / OVERVIEW) { // the whole drawing can be read
      const [x, y, w, h] = this.whole;
      if (this.moved !== -1 || this.sized !== clientWidth * clientHeight) this.centre(x + w / 2, y + h / 2, unit);
      this.moved = -1;
      this.sized = clientWidth * clientHeight;
      return;
    }
    const readable = LETTER / LEAST;
    const fits = (area) => area && area.right - area.x <= clientWidth * readable && area.bottom - area.y <= clientHeight * readable;
    const active = leaves.map((key) => this.boxes.get(key)).filter(Boolean);
    const areas = [[...this.recent.keys(), this.boxes.get(arrow)], [...active, this.boxes.get(arrow)], active, active.slice(-1)].map(union);
    const area = areas.find(fits) || areas[3];
    if (!area) return;
    const [x, y, w, h] = this.box;
    const margin = 0.06;
    const isInside = area.x >= x + w * margin && area.y >= y + h * margin && area.right <= x + w * (1 - margin) && area.bottom <= y + h * (1 - margin);
    const isAtEdge = area.x >= x && area.y >= y && area.right <= x + w && area.bottom <= y + h; // nothing more to be seen beyond
    const wasSized = Math.abs(this.unit() / readable - 1) < 0.02;
    if (wasSized && (isInside || (isAtEdge && this.aimed === key4(area)))) return;
    if (now - this.moved < REST) {
      setTimeout(this.changed, REST);
      return;
    }
    this.moved = now;
    this.aimed = key4(area);
    this.centre((area.x + area.right) / 2, (area.y + area.bottom) / 2, readable);
  }

  setFollowing(isFollowing) {
    this.isFollowing = isFollowing;
    this.moved = 0;
  }

  showWhole() {
    this.setFollowing(false);
    if (this.svg) this.lookAt([...this.whole]);
  }

  /** Zoom around a point of the frame, given in fractions of its size. */
  zoom(by, fx = 0.5, fy = 0.5) {
    if (!this.svg) return;
    this.setFollowing(false);
    const [x, y, w, h] = this.box;
    const to = Math.min(Math.max(by, this.whole[2] / w / 50), (3 * this.whole[2]) / w);
    this.lookAt([x + fx * w * (1 - to), y + fy * h * (1 - to), w * to, h * to]);
  }

  /** Move by parts of the frame. */
  pan(fx, fy) {
    if (!this.svg) return;
    this.setFollowing(false);
    const [x, y, w, h] = this.box;
    this.lookAt([x + fx * w, y + fy * h, w, h]);
  }

  /**
   * Return the place of the small map in pixels of the frame: in a corner, as large as it can be
   * without covering a text; null if each is covered. It stays in its corner where it can.
   */
  placeOfMap() {
    const { width, height } = this;
    const [, , w, h] = this.whole;
    const unit = this.unit();
    const left = this.box[0] - (width * unit - this.box[2]) / 2; // the left edge of the frame, centred on the box
    const top = this.box[1] - (height * unit - this.box[3]) / 2;
    const corners = [[1, 1], [0, 1], [1, 0], [0, 0]];
    if (this.corner) corners.unshift(this.corner);
    for (const size of [1, 0.7, 0.5]) {
      const scale = Math.max(w / Math.min(150, width / 4), h / Math.min(120, height / 4)) / size;
      const [wide, high] = [Math.ceil(w / scale) + 2, Math.ceil(h / scale) + 2]; // with its border
      for (const corner of corners) {
        const [x, y] = [corner[0] ? width - wide - MAP_GAP : MAP_GAP, corner[1] ? height - high - MAP_GAP : MAP_GAP];
        const [from, to] = [[left + (x - 2) * unit, top + (y - 2) * unit], [left + (x + wide + 2) * unit, top + (y + high + 2) * unit]];
        if (this.texts.some((text) => text.right > from[0] && text.x < to[0] && text.bottom > from[1] && text.y < to[1])) continue;
        this.corner = corner;
        return { x, y, scale };
      }
    }
    return null;
  }

  /** Draw the small map, where not all is seen. */
  drawMap(active) {
    if (!this.svg || !this.boxes) return;
    const [x, y, w, h] = this.whole;
    const isWhole = this.box[2] >= w * 0.98 && this.box[3] >= h * 0.98;
    const place = isWhole ? null : this.placeOfMap();
    this.map.hidden = !place;
    if (!place) return;
    const { scale: unit } = place;
    this.map.style.left = `${place.x}px`;
    this.map.style.top = `${place.y}px`;
    const key = `${this.box.map(Math.round)} ${unit} ${active.join()} ${palette("ink")}`;
    if (this.mapped === key) return;
    this.mapped = key;
    this.map.width = Math.ceil(w / unit);
    this.map.height = Math.ceil(h / unit);
    const pen = this.map.getContext("2d");
    pen.setTransform(1 / unit, 0, 0, 1 / unit, -x / unit, -y / unit);
    const on = new Set(active);
    for (const [name, box] of this.boxes) {
      if (name[0] !== "s") continue;
      pen.lineWidth = unit;
      pen.strokeStyle = palette("faint");
      if (on.has(name)) {
        pen.fillStyle = palette("active-line");
        pen.fillRect(box.x, box.y, box.right - box.x, box.bottom - box.y);
      } else pen.strokeRect(box.x, box.y, box.right - box.x, box.bottom - box.y);
    }
    pen.lineWidth = 2 * unit;
    pen.strokeStyle = palette("taken");
    pen.strokeRect(...this.box);
  }

  listen() {
    const { frame } = this;
    const parts = (event) => {
      const rect = frame.getBoundingClientRect();
      return [(event.clientX - rect.left) / rect.width, (event.clientY - rect.top) / rect.height];
    };
    frame.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.2 : 1 / 1.2, ...parts(event));
      this.changed();
    }, { passive: false });
    const down = new Map(); // pointer: where it is
    frame.addEventListener("pointerdown", (event) => {
      if (!this.svg || event.target === this.map) return;
      down.set(event.pointerId, event);
      this.from = { x: event.clientX, y: event.clientY, box: [...this.box], isMoved: false };
    });
    window.addEventListener("pointermove", (event) => {
      if (!down.has(event.pointerId) || !this.svg) return;
      const before = spread(down);
      down.set(event.pointerId, event);
      if (down.size === 2) {
        this.from.isMoved = true;
        this.zoom(before / (spread(down) || 1), ...parts(event));
      } else {
        const [dx, dy] = [event.clientX - this.from.x, event.clientY - this.from.y];
        if (!this.from.isMoved && Math.hypot(dx, dy) < 4) return;
        this.from.isMoved = true;
        this.setFollowing(false);
        const unit = this.unit(this.from.box);
        this.lookAt([this.from.box[0] - dx * unit, this.from.box[1] - dy * unit, this.from.box[2], this.from.box[3]]);
      }
      this.changed();
    });
    for (const name of ["pointerup", "pointercancel"]) {
      window.addEventListener(name, (event) => {
        if (down.delete(event.pointerId) && this.from && this.from.isMoved) this.dragged = performance.now();
      });
    }
    const jump = (event) => {
      if (!event.buttons) return;
      const rect = this.map.getBoundingClientRect();
      this.setFollowing(false);
      this.centre(this.whole[0] + ((event.clientX - rect.left) / rect.width) * this.whole[2], this.whole[1] + ((event.clientY - rect.top) / rect.height) * this.whole[3], this.unit());
      this.changed();
    };
    this.map.addEventListener("pointerdown", jump);
    this.map.addEventListener("pointermove", jump);
  }

  /** Whether a click is the end of a drag. */
  get isDragged() {
    return performance.now() - (this.dragged || -1000) < 60;
  }
}

const key4 = (area) => `${area.x} ${area.y} ${area.right} ${area.bottom}`;

/** Return the smallest box around others; nothing around none. */
function union(boxes) {
  return boxes.filter(Boolean).reduce((all, box) => (all ? { x: Math.min(all.x, box.x), y: Math.min(all.y, box.y), right: Math.max(all.right, box.right), bottom: Math.max(all.bottom, box.bottom) } : box), null);
}

/** Return how far two fingers are from each other. */
function spread(down) {
  const [one, other] = [...down.values()];
  return one && other ? Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) : 0;
}

/**
 * Make texts as narrow as they were where they were laid out, should this screen have wider letters:
 * up to the next text of the line, or to the right border of their box, as far off as the left one.
 * Beside arrows there is no box: those are narrowed as much as the one in a box that was most so.
 */
function fitTexts(svg) {
  let least = 1;
  const beside = [];
  for (const group of svg.querySelectorAll(".state, .edge, [class~=transition]")) {
    const texts = [...group.querySelectorAll("text")].filter((text) => text.closest(".state, .edge, [class~=transition]") === group);
    const border = group.matches(".state") && group.querySelector("path, polygon");
    const box = border && border.getBBox();
    const starts = texts.map((text) => ({ text, x: Number(text.getAttribute("x")), y: Number(text.getAttribute("y")) }));
    const gap = box ? Math.max(Math.min(...starts.map(({ x }) => x - box.x), 12), 2) : 0;
    for (const { text, x, y } of starts) {
      if (text.getAttribute("text-anchor") !== "start") continue;
      const next = Math.min(...starts.filter((each) => each.y === y && each.x > x).map((each) => each.x - 1));
      const room = Math.min(next, box ? box.x + box.width - gap : Infinity) - x;
      const length = text.getComputedTextLength();
      if (room === Infinity) beside.push([text, length]);
      else if (room > 0 && length > room + 1) {
        least = Math.min(least, room / length);
        narrow(text, room);
      }
    }
  }
  if (least < 0.97) for (const [text, length] of beside) narrow(text, length * least);
}

function narrow(text, length) {
  text.setAttribute("textLength", length.toFixed(1));
  text.setAttribute("lengthAdjust", "spacingAndGlyphs");
}
