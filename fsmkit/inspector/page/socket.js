"use strict";
// The transport: a WebSocket to `fsmkit serve`. A replacement is an object `transport`
// with the same two functions; page.js does not see the difference.

const transport = {
  socket: null,

  /** Go on trying; give each message, and "open", "lost" (it was open) or "closed" as it changes. */
  connect(onmessage, onchange) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live?token=${encodeURIComponent(token())}`, "fsmkit.live.1");
    let isOpen = false;
    socket.addEventListener("open", () => { isOpen = true; onchange("open"); });
    socket.addEventListener("message", (event) => {
      const found = JSON.parse(event.data);
      for (const message of Array.isArray(found) ? found : [found]) onmessage(message);
    });
    socket.addEventListener("close", () => {
      onchange(isOpen ? "lost" : "closed");
      setTimeout(() => transport.connect(onmessage, onchange), 1000);
    });
    this.socket = socket;
  },

  /** Send a command; return false without a connection. */
  send(command) {
    if (!this.socket || this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  },
};

/** Take the token out of the address, where it could be seen and sent on. */
function token() {
  const given = location.hash.slice(1);
  if (given) {
    sessionStorage.setItem("fsmkit.token", given);
    history.replaceState(null, "", location.pathname);
  }
  return given || sessionStorage.getItem("fsmkit.token") || "";
}
