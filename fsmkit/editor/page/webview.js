"use strict";
// The transport of a page inside an editor: messages of its webview.

const transport = {
  host: acquireVsCodeApi(),
  socket: { readyState: WebSocket.OPEN },

  connect(onmessage, onchange) {
    window.addEventListener("message", ({ data }) => {
      if (data.kind === "messages") for (const message of [].concat(JSON.parse(data.text))) onmessage(message);
      else if (data.kind === "lost") {
        this.socket.readyState = WebSocket.CLOSED;
        onchange("lost");
      }
    });
    onchange("open");
    this.host.postMessage({ kind: "ready" });
  },

  send(command) {
    const isOpen = this.socket.readyState === WebSocket.OPEN;
    if (isOpen) this.host.postMessage({ kind: "command", command });
    return isOpen;
  },
};
