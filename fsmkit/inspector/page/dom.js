"use strict";
// Nodes from text that nobody trusts: textContent alone, and drawings through lists.

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

/** Make an element; children are nodes or texts. */
function make(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** Make an element of a drawing. */
function shape(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.map((child) => (child instanceof Node ? child : String(child))));
  return node;
}

/** Set a text, an attribute or a class only if it is another one: what stays costs no layout. */
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function setAttribute(node, name, value) {
  if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
}

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
  if (tag === "a" && tip) node.append(shape("title", {}, tip));
  for (const child of source.childNodes) {
    if (child.nodeType === Node.TEXT_NODE) node.append(child.data);
    else if (child.nodeType === Node.ELEMENT_NODE && child.localName !== "title") {
      const found = copied(child);
      if (found) node.append(found);
    }
  }
  return node;
}

/** The visible elements; others are not painted. */
const unseen = new Set();
const watcher = new IntersectionObserver((found) => {
  for (const { target, isIntersecting } of found) {
    if (isIntersecting) unseen.delete(target);
    else unseen.add(target);
  }
  if (typeof repaint === "function") repaint();
});

/** Whether an element that is watched can be seen: not scrolled away, hidden or folded. */
const isSeen = (node) => !unseen.has(node) && node.open !== false;

/** Colours of the style sheet, for canvases. */
const palette = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
