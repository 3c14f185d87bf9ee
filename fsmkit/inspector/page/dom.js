"use strict";
// Nodes from text that nobody trusts: textContent alone, and drawings through lists.

const $ = (id) => document.getElementById(id);

/** Make an element; children are nodes or texts. */
function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.map((child) => (child instanceof Node ? child : String(child))));
  return node;
}

const SVG = "http://www.w3.org/2000/svg";
const ELEMENTS = new Set(["svg", "g", "path", "polygon", "polyline", "ellipse", "circle", "rect", "line", "text", "tspan", "title", "a"]);
const ATTRIBUTES = new Set(["id", "class", "transform", "d", "points", "cx", "cy", "r", "rx", "ry", "x", "y", "x1", "y1", "x2", "y2",
  "width", "height", "viewBox", "fill", "stroke", "stroke-width", "stroke-dasharray", "text-anchor", "font-family", "font-size", "font-weight", "font-style"]);

/** Return a drawing with the elements and attributes of the lists only; links are groups. */
function safeDrawing(text) {
  const read = new DOMParser().parseFromString(text, "image/svg+xml");
  return read.querySelector("parsererror") ? null : copied(read.documentElement);
}

function copied(source) {
  const tag = source.localName;
  if (source.namespaceURI !== SVG || !ELEMENTS.has(tag)) return null;
  const node = document.createElementNS(SVG, tag === "a" ? "g" : tag);
  for (const { localName, prefix, value } of source.attributes) {
    if (!prefix && ATTRIBUTES.has(localName) && !/url\s*\(/i.test(value)) node.setAttribute(localName, value);
  }
  const tip = source.getAttributeNS("http://www.w3.org/1999/xlink", "title");
  if (tag === "a" && tip) {
    const title = document.createElementNS(SVG, "title");
    title.textContent = tip;
    node.append(title);
  }
  for (const child of source.childNodes) {
    if (child.nodeType === Node.TEXT_NODE) node.append(child.data);
    else if (child.nodeType === Node.ELEMENT_NODE && child.localName !== "title") {
      const found = copied(child);
      if (found) node.append(found);
    }
  }
  return node;
}

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
