// A stub of `vscode`: what the extension uses, recorded, so that no editor is downloaded.

import Module from "node:module";

export const log: string[] = [];
export const posted: unknown[] = [];
export const commands = new Map<string, (...args: any[]) => any>();
export const listeners = new Map<string, ((event: any) => any)[]>();
export const settings = new Map<string, unknown>();
export let answer: string | undefined;
export let environment: string | undefined;

export function choose(value: string | undefined): void {
  answer = value;
}

export function select(python: string | undefined): void {
  environment = python;
}

class Disposable {
  constructor(private readonly act: () => void = () => undefined) {}

  dispose(): void {
    this.act();
  }
}

function on(name: string): (act: (event: any) => any) => Disposable {
  return (act) => {
    const known = listeners.get(name) ?? [];
    listeners.set(name, [...known, act]);
    return new Disposable(() => listeners.set(name, (listeners.get(name) ?? []).filter((l) => l !== act)));
  };
}

export function fire(name: string, event: unknown): Promise<unknown[]> {
  return Promise.all((listeners.get(name) ?? []).map((act) => act(event)));
}

class Uri {
  private constructor(readonly text: string) {}

  static parse(text: string): Uri {
    return new Uri(text);
  }

  static joinPath(base: Uri, ...parts: string[]): Uri {
    return new Uri([base.text, ...parts].join("/"));
  }

  get scheme(): string {
    return this.text.slice(0, this.text.indexOf(":"));
  }

  get fsPath(): string {
    return this.text.replace("file://", "");
  }

  toString(): string {
    return this.text;
  }
}

class Position {
  constructor(readonly line: number, readonly character: number) {}
}

class Range {
  constructor(readonly line: number, readonly character: number, readonly endLine: number, readonly endCharacter: number) {}
}

class Location {
  constructor(readonly uri: Uri, readonly range: Range) {}
}

export const panels: any[] = [];
/** Whether the workspace is trusted, and whether its disk can be written. */
export const rights = { trusted: true, writable: true };

export function panel(): any {
  return {
    reveal: () => { log.push("reveal"); },
    dispose: () => { log.push("close panel"); },
    webview: {
      html: "",
      cspSource: "https://stub",
      asWebviewUri: (uri: Uri) => uri,
      onDidReceiveMessage: on("message"),
      postMessage: (message: unknown) => { posted.push(message); return Promise.resolve(true); },
    },
    onDidDispose: on("dispose"),
  };
}

export const api = {
  Uri, Position, Range, Location, Disposable,
  ViewColumn: { One: 1, Beside: -2 },
  window: {
    activeTextEditor: { document: { uri: Uri.parse("file:///gate.yaml") } },
    showInformationMessage: (text: string) => { log.push(`message ${text}`); return Promise.resolve(answer); },
    showTextDocument: (uri: Uri, options: any) => {
      log.push(`show ${uri.toString()}${options.selection === undefined ? "" : `:${options.selection.line + 1}`}`);
      return Promise.resolve();
    },
    setStatusBarMessage: (text: string) => { log.push(`status ${text}`); },
    createTerminal: () => ({ show: () => undefined, sendText: (text: string) => log.push(`terminal ${text}`) }),
    createWebviewPanel: () => { const found = panel(); panels.push(found); return found; },
    onDidChangeTextEditorSelection: on("selection"),
  },
  workspace: {
    get isTrusted() { return rights.trusted; },
    fs: { isWritableFileSystem: () => rights.writable },
    workspaceFolders: [{ uri: Uri.parse("file:///work") }],
    getConfiguration: () => ({ get: (name: string, otherwise: unknown) => settings.get(name) ?? otherwise }),
    onDidChangeTextDocument: on("text"),
    registerTextDocumentContentProvider: () => new Disposable(),
  },
  commands: {
    registerCommand: (name: string, act: (...args: any[]) => any) => {
      commands.set(name, act);
      return new Disposable(() => commands.delete(name));
    },
    executeCommand: (name: string, ...args: unknown[]) => {
      log.push(`command ${name}`);
      return Promise.resolve(commands.get(name)?.(...args));
    },
  },
  extensions: {
    getExtension: () => environment === undefined ? undefined : {
      isActive: true,
      exports: { environments: { getActiveEnvironmentPath: () => ({ path: environment }) } },
    },
  },
};

export class Client {
  static made: Client[] = [];
  static pictures: any[] = [];
  static answers = new Map<string, any>();
  requests: [string, any][] = [];
  sent: [string, any][] = [];
  handlers = new Map<string, (params: any) => void>();

  constructor(readonly id: string, readonly name: string, readonly server: any, readonly options: any) {
    Client.made.push(this);
  }

  start(): Promise<void> { log.push("start"); return Promise.resolve(); }
  stop(): Promise<void> { log.push("stop"); return Promise.resolve(); }
  dispose(): Promise<void> { log.push("dispose"); return Promise.resolve(); }

  sendRequest(method: string, params: any): Promise<any> {
    this.requests.push([method, params]);
    if (Client.answers.has(method)) {
      return Promise.resolve(Client.answers.get(method));
    }
    return Promise.resolve(method === "fsmkit/draw" ? Client.pictures.shift() : { verdict: "holds" });
  }

  sendNotification(method: string, params: any): Promise<void> {
    this.sent.push([method, params]);
    return Promise.resolve();
  }

  onNotification(method: string, act: (params: any) => void): void { this.handlers.set(method, act); }
}

const load = (Module as any)._load;
(Module as any)._load = function stubbed(name: string, ...rest: unknown[]): unknown {
  if (name === "vscode") {
    return api;
  }
  if (name === "vscode-languageclient/node") {
    return { LanguageClient: Client };
  }
  return load.call(this, name, ...rest);
};
