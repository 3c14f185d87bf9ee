import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { api, choose, Client, commands, fire, listeners, log, panel, panels, posted, rights, select, settings } from "./vscode";
import { activate, deactivate, machine } from "../src/extension";
import { find, type Machine } from "../src/interpreter";
import { atLine, harmless, html, type Item } from "../src/page";
import { Preview } from "../src/preview";

const GATE = "file:///gate.yaml";
const ITEMS: Record<string, Item> = {
  s1: { kind: "state", name: "shut", uri: GATE, line: 4, character: 2, endLine: 4 },
  s2: { kind: "state", name: "open", uri: GATE, line: 7, character: 2, endLine: 7 },
  t1: { kind: "transition", name: "", uri: GATE, line: 5, character: 8, endLine: 5 },
};

function of(files: string[], servers: string[] = [], platform = "linux"): Machine {
  return {
    platform,
    folders: ["/usr/bin", "/opt/bin"],
    isFile: (file) => files.includes(file),
    hasServer: (python) => Promise.resolve(servers.includes(python)),
  };
}

function context(): any {
  return { subscriptions: [], extensionUri: api.Uri.parse("file:///extension") };
}

beforeEach(() => {
  log.length = 0;
  posted.length = 0;
  listeners.clear();
  settings.clear();
  Client.made.length = 0;
  Client.pictures.length = 0;
  Client.answers.clear();
  panels.length = 0;
  rights.trusted = rights.writable = true;
  choose(undefined);
  select(undefined);
});
afterEach(() => deactivate());

test("a setting counts first", async () => {
  const found = await find({ command: "/x/fsmkit", python: "/p" }, "/s", of(["/usr/bin/fsmkit"], ["/p", "/s"]));
  assert.deepEqual(found, { command: "/x/fsmkit", args: ["lsp"] });
});

test("the selected environment counts before the path", async () => {
  const files = ["/env/bin/fsmkit", "/usr/bin/fsmkit"];
  const found = await find({ command: "", python: "" }, "/env/bin/python", of(files, ["/env/bin/python"]));
  assert.deepEqual(found, { command: "/env/bin/fsmkit", args: ["lsp"] });
});

test("an environment without the program starts the module", async () => {
  const found = await find({ command: "", python: "/p/python" }, undefined, of([], ["/p/python"]));
  assert.deepEqual(found, { command: "/p/python", args: ["-m", "fsmkit", "lsp"] });
});

test("an environment without fsmkit is passed over", async () => {
  const found = await find({ command: "", python: "" }, "/env/bin/python", of(["/opt/bin/fsmkit"]));
  assert.deepEqual(found, { command: "/opt/bin/fsmkit", args: ["lsp"] });
  assert.equal(await find({ command: "", python: "" }, undefined, of([])), undefined);
});

test("it starts the server of the setting, and stops it", async () => {
  settings.set("command", "/x/fsmkit");
  await activate(context());
  assert.deepEqual(Client.made[0]?.server, { command: "/x/fsmkit", args: ["lsp"] });
  assert.deepEqual(Client.made[0]?.options.documentSelector.map((s: any) => s.language), ["yaml", "scxml", "xml"]);
  await deactivate();
  assert.deepEqual(log, ["start", "stop"]);
});

test("without fsmkit it offers to make an environment", async () => {
  const folders = machine.folders;
  machine.folders = [];
  choose("Make an Environment");
  await activate(context());
  machine.folders = folders;
  assert.equal(Client.made.length, 0);
  assert.ok(log.includes("command fsmkit.install"));
  assert.ok(log.some((line) => line.includes("pip install \"fsmkit[lsp]\"")));
});

test("a counterexample opens its line and a page", async () => {
  settings.set("command", "/x/fsmkit");
  await activate(context());
  const path = {
    title: "never_open: violated", markdown: "# path",
    location: { uri: GATE, range: { start: { line: 4, character: 8 } } },
  };
  const { executeCommand } = Client.made[0]!.options.middleware;
  const answer = await executeCommand("fsmkit.counterexample", [GATE, "never_open"], () => path);
  assert.equal(answer, path);
  assert.ok(log.includes(`show ${GATE}:5`));
  assert.ok(log.includes("command markdown.showPreviewToSide"));
  await executeCommand("fsmkit.counterexample", [GATE, "gone"], () => null);
  assert.ok(log.some((line) => line.includes("no path to show")));
});

test("a check tells its verdict", async () => {
  settings.set("command", "/x/fsmkit");
  await activate(context());
  await commands.get("fsmkit.checkFile")?.();
  assert.deepEqual(Client.made[0]?.requests[0]?.[1], { command: "fsmkit.check", arguments: [GATE] });
  assert.ok(log.includes("status fsmkit: holds"));
});

test("the preview draws, keeps the last picture, goes to lines, marks and folds", async () => {
  const asked: string[][] = [];
  const answers = [
    { svg: "<svg id=\"a\"/>", items: ITEMS }, { error: "this does not parse" },
    { svg: "<svg id=\"b\"/>", items: ITEMS },
  ];
  const preview = new Preview(api.Uri.parse(GATE) as any, panel(), (_, folded) => {
    asked.push(folded);
    return Promise.resolve(answers.shift()!);
  }, api.Uri.parse("file:///extension") as any);
  await preview.show();
  assert.deepEqual(posted, []);
  await fire("message", { kind: "ready" });
  assert.deepEqual(posted.pop(), { kind: "picture", svg: "<svg id=\"a\"/>" });
  await preview.show();
  assert.deepEqual(posted.pop(), { kind: "note", text: "this does not parse" });
  await fire("message", { kind: "go", id: "t1" });
  assert.ok(log.includes(`show ${GATE}:6`));
  await fire("selection", { textEditor: { document: { uri: GATE } }, selections: [{ active: { line: 8 } }] });
  assert.deepEqual(posted.pop(), { kind: "mark", id: "s2" });
  await fire("message", { kind: "fold", id: "s1" });
  assert.deepEqual(asked.at(-1), ["shut"]);
  preview.dispose();
  assert.deepEqual(listeners.get("selection"), []);
});

test("a path is replayed step by step", async () => {
  const asked: unknown[][] = [];
  const steps = [
    { text: "start", uri: GATE, active: ["shut"], locations: [] },
    { text: "go", uri: GATE, active: ["open"], locations: [{ uri: GATE, range: { start: { line: 5, character: 8 } } }] },
  ];
  const preview = new Preview(api.Uri.parse("file:///two.yaml") as any, panel(), (...given) => {
    asked.push(given);
    return Promise.resolve({ svg: "<svg/>", items: ITEMS });
  }, api.Uri.parse("file:///extension") as any, steps);
  await fire("message", { kind: "ready" });
  assert.deepEqual(posted.pop(), { kind: "note", text: "1 of 2: start (← →)" });
  await fire("message", { kind: "step", by: 1 });
  await fire("message", { kind: "step", by: 1 });
  assert.deepEqual(asked, [[GATE, [], ["shut"]], [GATE, [], ["open"]]]);
  assert.ok(log.includes(`show ${GATE}:6`));
  preview.dispose();
});

test("the preview follows a valid edit after its pause", async () => {
  const began = Date.now();
  let took = Infinity;
  const preview = new Preview(api.Uri.parse(GATE) as any, panel(), () => {
    took = Date.now() - began;
    return Promise.resolve({ svg: "<svg/>", items: ITEMS });
  }, api.Uri.parse("file:///extension") as any);
  await fire("message", { kind: "ready" });
  took = Infinity;
  await fire("text", {});
  while (took === Infinity) {
    await new Promise((done) => setTimeout(done, 5));
  }
  assert.ok(took >= 100);
  preview.dispose();
});

test("the page lets nothing from elsewhere run", () => {
  const page = html("https://stub", "https://stub/preview.js", "abc");
  assert.match(page, /default-src 'none'/);
  assert.match(page, /script-src 'nonce-abc'/);
  const svg = harmless(
    "<?xml version=\"1.0\"?><svg onload=\"x()\"><script>x()</script><a href=\"https://x\"/>"
    + "<a href=\"#t1\"/><foreignObject><p/></foreignObject></svg>",
  );
  assert.equal(svg, "<svg><a/><a href=\"#t1\"/></svg>");
});

test("a line belongs to the state before it", () => {
  assert.equal(atLine(ITEMS, GATE, 5), "s1");
  assert.equal(atLine(ITEMS, GATE, 99), "s2");
  assert.equal(atLine(ITEMS, GATE, 1), undefined);
  assert.equal(atLine(ITEMS, "file:///other.yaml", 5), undefined);
});

async function edited(): Promise<Client> {
  settings.set("command", "/x/fsmkit");
  Client.answers.set("fsmkit/page/open", { page: 3, html: "<p>page</p>" });
  await activate(context());
  await commands.get("fsmkit.editDrawing")?.();
  return Client.made[0]!;
}

test("the page that edits passes messages on, both ways", async () => {
  const server = await edited();
  assert.deepEqual(server.requests, [["fsmkit/page/open", { uri: GATE, readonly: false }]]);
  assert.equal(panels[0].webview.html, "<p>page</p>");
  await fire("message", { kind: "ready" });
  const command = { id: 1, do: "edit", operations: [{ op: "AddState", parent: "", name: "a" }], hash: "x" };
  await fire("message", { kind: "command", command });
  assert.deepEqual(server.sent, [
    ["fsmkit/page/join", { page: 3 }], ["fsmkit/page/receive", { page: 3, text: JSON.stringify(command) }],
  ]);
  server.handlers.get("fsmkit/page/messages")!({ page: 3, text: "[1]" });
  server.handlers.get("fsmkit/page/messages")!({ page: 4, text: "[2]" });
  assert.deepEqual(posted, [{ kind: "messages", text: "[1]" }]);
  await fire("dispose", undefined);
  assert.deepEqual(server.sent.at(-1), ["fsmkit/page/close", { page: 3 }]);
});

test("undo in the page is undo in the document", async () => {
  const server = await edited();
  await fire("message", { kind: "command", command: { id: 5, do: "undo" } });
  await fire("message", { kind: "command", command: { id: 6, do: "redo" } });
  assert.deepEqual(log.slice(-6), [`show ${GATE}`, "command undo", "reveal", `show ${GATE}`, "command redo", "reveal"]);
  assert.deepEqual(server.sent, []);
  assert.deepEqual(posted.at(-1), { kind: "messages", text: JSON.stringify({ k: "done", re: 6, result: null }) });
});

test("a folder that is not trusted, or cannot be written, is not edited", async () => {
  for (const right of ["trusted", "writable"] as const) {
    rights.trusted = rights.writable = true;
    rights[right] = false;
    Client.made.length = 0;
    const server = await edited();
    assert.equal(server.requests[0]![1].readonly, true);
    await fire("message", { kind: "command", command: { id: 5, do: "undo" } });
    assert.equal(server.sent.at(-1)?.[0], "fsmkit/page/receive");
    assert.ok(!log.includes("command undo"));
    listeners.clear();
    await deactivate();
  }
});

test("a page that cannot be opened, and a server that ends, are shown", async () => {
  settings.set("command", "/x/fsmkit");
  await commands.get("fsmkit.editDrawing")?.();
  assert.ok(log.some((line) => line.includes("start the server")));
  Client.answers.set("fsmkit/page/open", { error: "8 pages are open: close one" });
  await activate(context());
  await commands.get("fsmkit.editDrawing")?.();
  assert.ok(log.includes("close panel"));
  assert.ok(log.some((line) => line.includes("8 pages are open")));
  Client.answers.set("fsmkit/page/open", { page: 3, html: "" });
  await commands.get("fsmkit.editDrawing")?.();
  await commands.get("fsmkit.restart")?.();
  assert.deepEqual(posted, [{ kind: "lost" }]);
});
