// The page that edits a drawing: the server has the page and the session, the document its text.

import * as vscode from "vscode";

/** Sends a request or a notification to the server. */
export interface Server {
  request(method: string, params: object): Promise<any>;
  notify(method: string, params: object): Promise<void>;
}

/** A message of the page. */
export type FromEditor =
  | { kind: "ready" }
  | { kind: "command"; command: { id: number; do: string } };

/** A message of the server for a page. */
export interface Messages {
  page: number;
  text: string;
}

/** Return whether a document must not be changed: its folder is not trusted, or its disk is read-only. */
export function isReadonly(uri: vscode.Uri): boolean {
  return !vscode.workspace.isTrusted || vscode.workspace.fs.isWritableFileSystem(uri.scheme) === false;
}

export class EditPage {
  private readonly watching: vscode.Disposable[] = [];

  private constructor(
    readonly number: number,
    readonly uri: vscode.Uri,
    private readonly panel: vscode.WebviewPanel,
    private readonly server: Server,
    private readonly readonly: boolean,
    private readonly closed: (page: EditPage) => void,
  ) {
    this.watching.push(
      panel.webview.onDidReceiveMessage((message: FromEditor) => this.receive(message)),
      panel.onDidDispose(() => this.dispose()),
    );
  }

  /** Open a page of a document; undefined with a message if the server cannot. */
  static async open(
    uri: vscode.Uri, panel: vscode.WebviewPanel, server: Server, closed: (page: EditPage) => void,
  ): Promise<EditPage | undefined> {
    const readonly = isReadonly(uri);
    const found = await server.request("fsmkit/page/open", { uri: uri.toString(), readonly });
    if (found.page === undefined) {
      panel.dispose();
      await vscode.window.showInformationMessage(`The drawing cannot be edited: ${found.error}.`);
      return undefined;
    }
    const page = new EditPage(found.page, uri, panel, server, readonly, closed);
    panel.webview.html = found.html;
    return page;
  }

  /** Pass messages of the server on to the page. */
  take(text: string): void {
    void this.panel.webview.postMessage({ kind: "messages", text });
  }

  /** Show that the server has ended. */
  lose(): void {
    void this.panel.webview.postMessage({ kind: "lost" });
  }

  dispose(): void {
    for (const one of this.watching.splice(0)) {
      one.dispose();
    }
    this.closed(this);
    void this.server.notify("fsmkit/page/close", { page: this.number });
  }

  private async receive(message: FromEditor): Promise<void> {
    if (message.kind === "ready") {
      await this.server.notify("fsmkit/page/join", { page: this.number });
      return;
    }
    const { command } = message;
    if ((command.do === "undo" || command.do === "redo") && !this.readonly) {
      await this.step(command.do);
      this.take(JSON.stringify({ k: "done", re: command.id, result: null }));
      return;
    }
    await this.server.notify("fsmkit/page/receive", { page: this.number, text: JSON.stringify(command) });
  }

  /** Undo or redo in the document, whose history has the edits of the page and of the text. */
  private async step(command: string): Promise<void> {
    await vscode.window.showTextDocument(this.uri, { viewColumn: vscode.ViewColumn.One });
    await vscode.commands.executeCommand(command);
    this.panel.reveal();
  }
}
