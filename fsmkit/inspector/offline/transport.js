"use strict";
// The transport of a page that simulates offline: a hub in the page, and a clock.

const transport = {
  hub: null,
  onmessage: null,
  last: 0,

  connect(onmessage, onchange) {
    onchange("open");
    this.onmessage = onmessage;
    this.hub = new offline.Hub(offline.description);
    this.hub.join((messages) => messages.forEach(onmessage));
    offerScenarios(offline.description.scenarios);
    this.last = performance.now();
    setInterval(() => this.tick(), 16);
  },

  /** Let as much time pass as has; a page in the background makes up at most a second. */
  tick() {
    const now = performance.now();
    const passed = Math.min(now - this.last, 1000);
    this.last = now;
    const until = now + 12;
    this.hub.advance(passed * 1000);
    while (this.hub.wantsMore && performance.now() < until) this.hub.advance(0);
  },

  /** Give a command; it is answered after those that wait. */
  send(command) {
    queueMicrotask(() => this.onmessage(this.hub.receive(command)));
    return true;
  },
};

/** Offer scenarios beside the drawing: one that is played becomes a branch, looked at from its start. */
function offerScenarios(scenarios) {
  if (!scenarios.length) return;
  const play = (scenario) => say("play", { scenario }).then(() => say("seek", { n: 0 }));
  const buttons = scenarios.map(({ name }) => make("button", { onclick: () => play(name) }, name));
  const title = make("h2", { id: "h-scenarios" }, "Scenarios");
  document.querySelector("aside").prepend(make("section", { "aria-labelledby": "h-scenarios" }, title, make("div", { class: "bar", id: "scenarios" }, ...buttons)));
}

/** An empty replacement for the picture of a plant, which only a server has. */
class Plant {
  begin() {}

  paint() {}
}
