// Shows a picture, keeps zoom and place while it changes, and tells which element was clicked.

"use strict";

(() => {
  const host = acquireVsCodeApi();
  const picture = document.getElementById("picture");
  const note = document.getElementById("note");
  let zoom = (host.getState() || { zoom: 1 }).zoom;
  let marked = "";

  function element(target) {
    for (let node = target; node && node !== picture; node = node.parentNode) {
      const match = /^([st]\d+)(?:_|$)/.exec(node.id || "");
      if (match) {
        return match[1];
      }
    }
    return "";
  }

  function scale() {
    const svg = picture.querySelector("svg");
    if (svg) {
      svg.setAttribute("transform", `scale(${zoom})`);
    }
    host.setState({ zoom });
  }

  function mark(id) {
    for (const old of picture.querySelectorAll(".marked")) {
      old.classList.remove("marked");
    }
    marked = id;
    const found = id && document.getElementById(id);
    if (found) {
      found.classList.add("marked");
    }
  }

  window.addEventListener("message", ({ data }) => {
    if (data.kind === "picture") {
      const { scrollLeft, scrollTop } = picture;
      const parsed = new DOMParser().parseFromString(data.svg, "image/svg+xml");
      picture.replaceChildren(document.importNode(parsed.documentElement, true));
      note.hidden = true;
      scale();
      mark(marked);
      picture.scrollTo(scrollLeft, scrollTop);
    } else if (data.kind === "note") {
      note.textContent = data.text;
      note.hidden = false;
    } else if (data.kind === "mark") {
      mark(data.id);
    }
  });
  picture.addEventListener("click", (event) => {
    const id = element(event.target);
    if (id) {
      event.preventDefault();
      host.postMessage({ kind: event.altKey ? "fold" : "go", id });
    }
  });
  window.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by !== undefined) {
      event.preventDefault();
      host.postMessage({ kind: "step", by });
    }
  });
  picture.addEventListener("wheel", (event) => {
    if (event.ctrlKey || event.metaKey) {
      event.preventDefault();
      zoom = Math.min(5, Math.max(0.1, zoom * (event.deltaY < 0 ? 1.1 : 0.9)));
      scale();
    }
  }, { passive: false });
  host.postMessage({ kind: "ready" });
})();
