// fsmkit in VS Code: starts the server, and has a preview, a check, and counterexamples to read.

import { execFile } from "node:child_process";
import * as fs from "node:fs";
import * as path from "node:path";
import * as vscode from "vscode";
import { LanguageClient, type LanguageClientOptions } from "vscode-languageclient/node";
import { EditPage, type Messages, type Server } from "./editing";
import { find, type Command, type Machine } from "./interpreter";
import type { Picture, Step } from "./page";
import { Preview } from "./preview";

const SELECTOR = [
  { scheme: "file", language: "yaml" },
  { scheme: "file", language: "scxml" },
  { scheme: "file", language: "xml" },
];
const SHOWN = "fsmkit-counterexample";
const LONGEST = 20_000;

let client: LanguageClient | undefined;
const shown = new Map<string, string>();
const pages = new Map<number, EditPage>();

export const machine: Machine = {
  platform: process.platform,
  folders: (process.env["PATH"] ?? "").split(path.delimiter),
  isFile: (file) => fs.statSync(file, { throwIfNoEntry: false })?.isFile() ?? false,
  hasServer: (python) => new Promise((resolve) => {
    execFile(python, ["-c", "import fsmkit, pygls, lsprotocol"], { timeout: LONGEST }, (error) => {
      resolve(error === null);
    });
  }),
};

/** Return the interpreter that the Python extension has selected. */
async function selected(): Promise<string | undefined> {
  const python = vscode.extensions.getExtension("ms-python.python");
  if (python === undefined) {
    return undefined;
  }
  const api = python.isActive ? python.exports : await python.activate();
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri;
  const found = api?.environments?.getActiveEnvironmentPath?.(folder)?.path;
  return typeof found === "string" ? found : undefined;
}

async function start(context: vscode.ExtensionContext): Promise<void> {
  const settings = vscode.workspace.getConfiguration("fsmkit");
  const given = { command: settings.get("command", ""), python: settings.get("python", "") };
  const command = await find(given, await selected(), machine);
  if (command === undefined) {
    const answer = await vscode.window.showInformationMessage(
      "There is no fsmkit in the selected Python environment, nor on the path.",
      "Make an Environment", "Open Settings",
    );
    if (answer === "Make an Environment") {
      await vscode.commands.executeCommand("fsmkit.install");
    } else if (answer === "Open Settings") {
      await vscode.commands.executeCommand("workbench.action.openSettings", "fsmkit.command");
    }
    return;
  }
  await serve(context, command);
}

async function serve(context: vscode.ExtensionContext, command: Command): Promise<void> {
  const options: LanguageClientOptions = {
    documentSelector: SELECTOR,
    synchronize: { configurationSection: "fsmkit" },
    markdown: { isTrusted: false },
    middleware: {
      // lenses name commands of the server; what it answers to these is for people to see
      executeCommand: async (name, args, next) => {
        const answer: unknown = await next(name, args);
        if (name === "fsmkit.counterexample") {
          await showPath(answer as Path | null);
        } else if (name === "fsmkit.check") {
          showVerdict(answer as { verdict: string } | null);
        } else if (name === "fsmkit.replay") {
          await replay(context, String(args[0]), answer as Replay | null);
        }
        return answer;
      },
    },
  };
  client = new LanguageClient("fsmkit", "fsmkit", command, options);
  context.subscriptions.push(client);
  client.onNotification("fsmkit/page/messages", ({ page, text }: Messages) => pages.get(page)?.take(text));
  await client.start();
}

/** Make an environment in the folder with what the server needs, in a terminal that shows it. */
function install(): void {
  const terminal = vscode.window.createTerminal("fsmkit");
  const bin = process.platform === "win32" ? ".venv\\Scripts\\python" : ".venv/bin/python";
  const python = process.platform === "win32" ? "py -3" : "python3";
  terminal.show();
  terminal.sendText(`${python} -m venv .venv`);
  terminal.sendText(`${bin} -m pip install "fsmkit[lsp]"`);
}

interface Replay {
  title: string;
  steps: Step[];
}

/** Show a path in the picture, step by step. */
async function replay(context: vscode.ExtensionContext, file: string, found: Replay | null): Promise<void> {
  if (found === null) {
    await vscode.window.showInformationMessage("There is no path to show any more: check again.");
    return;
  }
  openPicture(context, vscode.Uri.parse(file), found.title, found.steps);
}

function openPreview(context: vscode.ExtensionContext): void {
  const uri = vscode.window.activeTextEditor?.document.uri;
  if (uri !== undefined) {
    openPicture(context, uri, `Picture of ${path.basename(uri.fsPath)}`);
  }
}

function openPicture(context: vscode.ExtensionContext, uri: vscode.Uri, title: string, steps: Step[] = []): void {
  const panel = vscode.window.createWebviewPanel("fsmkit.preview", title, vscode.ViewColumn.Beside, {
    enableScripts: true,
    retainContextWhenHidden: true,
    localResourceRoots: [vscode.Uri.joinPath(context.extensionUri, "media")],
  });
  const draw = async (file: string, folded: string[], active: string[]): Promise<Picture> => {
    if (client === undefined) {
      return { error: "the server does not run" };
    }
    return client.sendRequest("fsmkit/draw", { uri: file, folded, active });
  };
  context.subscriptions.push(new Preview(uri, panel, draw, context.extensionUri, steps));
}

/** Open the page that edits the drawing of the active document. */
async function editDrawing(context: vscode.ExtensionContext): Promise<void> {
  const uri = vscode.window.activeTextEditor?.document.uri;
  const running = client;
  if (uri === undefined || running === undefined) {
    await vscode.window.showInformationMessage("Open a chart, and start the server, to edit its drawing.");
    return;
  }
  const server: Server = {
    request: (method, params) => running.sendRequest(method, params),
    notify: (method, params) => running === client ? running.sendNotification(method, params) : Promise.resolve(),
  };
  const title = `Drawing of ${path.basename(uri.fsPath)}`;
  const panel = vscode.window.createWebviewPanel("fsmkit.editing", title, vscode.ViewColumn.Beside, {
    enableScripts: true, retainContextWhenHidden: true, localResourceRoots: [],
  });
  const page = await EditPage.open(uri, panel, server, ({ number }) => pages.delete(number));
  if (page !== undefined) {
    pages.set(page.number, page);
    context.subscriptions.push(page);
  }
}

/** Forget the pages of a server that ends; they show that. */
function losePages(): void {
  for (const page of pages.values()) {
    page.lose();
  }
  pages.clear();
}

interface Path {
  title: string;
  markdown: string;
  location: { uri: string; range: { start: { line: number; character: number } } };
}

/** Show the path to a property as a document, and the line where it ends beside it. */
async function showPath(found: Path | null): Promise<void> {
  if (found === null) {
    await vscode.window.showInformationMessage("There is no path to show any more: check again.");
    return;
  }
  const page = vscode.Uri.parse(`${SHOWN}:${encodeURIComponent(found.title)}.md`);
  shown.set(page.toString(), found.markdown);
  const { line, character } = found.location.range.start;
  await vscode.window.showTextDocument(vscode.Uri.parse(found.location.uri), {
    selection: new vscode.Range(line, character, line, character),
  });
  await vscode.commands.executeCommand("markdown.showPreviewToSide", page);
}

function showVerdict(found: { verdict: string } | null): void {
  const text = found === null ? "this cannot be checked now" : found.verdict;
  vscode.window.setStatusBarMessage(`fsmkit: ${text}`, 5000);
}

async function checkFile(): Promise<void> {
  const file = vscode.window.activeTextEditor?.document.uri.toString();
  if (client !== undefined && file !== undefined) {
    showVerdict(await client.sendRequest("workspace/executeCommand", {
      command: "fsmkit.check", arguments: [file],
    }));
  }
}

function runFile(uri: string): void {
  const terminal = vscode.window.createTerminal({
    name: "fsmkit run", shellPath: "fsmkit", shellArgs: ["run", vscode.Uri.parse(uri).fsPath],
  });
  terminal.show();
}

interface Place {
  line: number;
  character: number;
}

function showReferences(uri: string, at: Place, locations: { uri: string; range: { start: Place; end: Place } }[]): void {
  const position = (place: Place): vscode.Position => new vscode.Position(place.line, place.character);
  void vscode.commands.executeCommand(
    "editor.action.showReferences",
    vscode.Uri.parse(uri),
    position(at),
    locations.map((each) => new vscode.Location(
      vscode.Uri.parse(each.uri),
      new vscode.Range(position(each.range.start), position(each.range.end)),
    )),
  );
}

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  const bind = (name: string, act: (...args: any[]) => unknown): void => {
    context.subscriptions.push(vscode.commands.registerCommand(name, act));
  };
  bind("fsmkit.openPreview", () => openPreview(context));
  bind("fsmkit.draw", () => openPreview(context));
  bind("fsmkit.editDrawing", () => editDrawing(context));
  bind("fsmkit.checkFile", () => checkFile());
  bind("fsmkit.run", runFile);
  bind("fsmkit.showReferences", showReferences);
  bind("fsmkit.install", install);
  bind("fsmkit.restart", async () => {
    losePages();
    await client?.dispose();
    client = undefined;
    await start(context);
  });
  context.subscriptions.push(vscode.workspace.registerTextDocumentContentProvider(SHOWN, {
    provideTextDocumentContent: (uri) => shown.get(uri.toString()) ?? "",
  }));
  await start(context);
}

export async function deactivate(): Promise<void> {
  losePages();
  await client?.stop();
  client = undefined;
}
