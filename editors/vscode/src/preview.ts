// The preview of a file: the server draws, the page shows; text and picture point at each other.

import * as vscode from "vscode";
import { atLine, harmless, html, type FromPage, type Item, type Picture, type Step, type ToPage } from "./page";

/** Asks the server for a picture. */
export type Draw = (uri: string, folded: string[], active: string[]) => Promise<Picture>;

const PAUSE = 150;

export class Preview {
  private items: Record<string, Item> = {};
  private folded = new Set<string>();
  private timer: NodeJS.Timeout | undefined;
  private isReady = false;
  private at = 0;
  private readonly watching: vscode.Disposable[] = [];

  constructor(
    readonly uri: vscode.Uri,
    private readonly panel: vscode.WebviewPanel,
    private readonly draw: Draw,
    extension: vscode.Uri,
    private readonly steps: Step[] = [],
  ) {
    const webview = panel.webview;
    const script = webview.asWebviewUri(vscode.Uri.joinPath(extension, "media", "preview.js"));
    webview.html = html(webview.cspSource, script.toString(), nonce());
    this.watching.push(
      webview.onDidReceiveMessage((message: FromPage) => this.receive(message)),
      vscode.workspace.onDidChangeTextDocument(() => this.later()),
      vscode.window.onDidChangeTextEditorSelection((event) => {
        this.mark(event.textEditor.document.uri.toString(), event.selections[0]?.active.line ?? 0);
      }),
      panel.onDidDispose(() => this.dispose()),
    );
  }

  dispose(): void {
    clearTimeout(this.timer);
    for (const one of this.watching.splice(0)) {
      one.dispose();
    }
  }

  private later(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.show(), PAUSE);
  }

  /** Draw; what cannot be drawn now leaves the last picture, with a note. */
  async show(): Promise<void> {
    if (!this.isReady) {
      return;
    }
    const step = this.steps[this.at];
    let picture: Picture;
    try {
      const uri = step?.uri ?? this.uri.toString();
      picture = await this.draw(uri, [...this.folded], step?.active ?? []);
    } catch (error) {
      picture = { error: error instanceof Error ? error.message : String(error) };
    }
    if (picture.svg !== undefined && picture.svg !== "") {
      this.items = picture.items ?? {};
      this.post({ kind: "picture", svg: harmless(picture.svg) });
    } else {
      this.post({ kind: "note", text: picture.error ?? "there is no picture" });
      return;
    }
    if (step !== undefined) {
      this.post({ kind: "note", text: `${this.at + 1} of ${this.steps.length}: ${step.text} (← →)` });
    }
  }

  /** Go some steps on, or back, and to the line of the step. */
  private async step(by: number): Promise<void> {
    const next = Math.min(this.steps.length - 1, Math.max(0, this.at + by));
    if (this.steps.length === 0 || next === this.at) {
      return;
    }
    this.at = next;
    await this.show();
    const place = this.steps[this.at]?.locations.at(-1);
    if (place !== undefined) {
      const { line, character } = place.range.start;
      await vscode.window.showTextDocument(vscode.Uri.parse(place.uri), {
        viewColumn: vscode.ViewColumn.One, preserveFocus: true,
        selection: new vscode.Range(line, character, line, character),
      });
    }
  }

  private mark(uri: string, line: number): void {
    const id = atLine(this.items, uri, line);
    if (id !== undefined) {
      this.post({ kind: "mark", id });
    }
  }

  private async receive(message: FromPage): Promise<void> {
    if (message.kind === "ready") {
      this.isReady = true;
      await this.show();
      return;
    }
    if (message.kind === "step") {
      await this.step(message.by);
      return;
    }
    const item = this.items[message.id];
    if (item === undefined) {
      return;
    }
    if (message.kind === "fold" && item.kind === "state") {
      if (!this.folded.delete(item.name)) {
        this.folded.add(item.name);
      }
      await this.show();
      return;
    }
    const place = new vscode.Range(item.line, item.character, item.line, item.character);
    await vscode.window.showTextDocument(vscode.Uri.parse(item.uri), {
      viewColumn: vscode.ViewColumn.One, selection: place,
    });
  }

  private post(message: ToPage): void {
    void this.panel.webview.postMessage(message);
  }
}

function nonce(): string {
  const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";
  return Array.from({ length: 32 }, () => letters[Math.floor(Math.random() * letters.length)]).join("");
}
