// The page of a preview: a picture, and a script of its own that zooms and tells of clicks.

export interface Item {
  kind: string;
  name: string;
  uri: string;
  line: number;
  character: number;
  endLine: number;
}

export interface Picture {
  svg?: string;
  items?: Record<string, Item>;
  error?: string;
}

/** A step of a path: what happens, in which chart, what is active then, and where that is. */
export interface Step {
  text: string;
  uri: string;
  active: string[];
  locations: { uri: string; range: { start: { line: number; character: number } } }[];
}

/** What a page tells. */
export type FromPage =
  | { kind: "ready" }
  | { kind: "go"; id: string }
  | { kind: "step"; by: number }
  | { kind: "fold"; id: string };

/** What a page is told. */
export type ToPage =
  | { kind: "picture"; svg: string }
  | { kind: "note"; text: string }
  | { kind: "mark"; id: string };

/** Return a picture without what could run in a page: scripts, handlers, foreign content. */
export function harmless(svg: string): string {
  return svg
    .replace(/<\?xml[^>]*\?>|<!DOCTYPE[^>]*>/gi, "")
    .replace(/<(script|foreignObject|iframe|image|style)\b(?:[^>]*\/>|[\s\S]*?<\/\1\s*>)/gi, "")
    .replace(/\son\w+\s*=\s*("[^"]*"|'[^']*')/gi, "")
    .replace(/\s(?:xlink:)?href\s*=\s*("(?!#)[^"]*"|'(?!#)[^']*')/gi, "");
}

/** Return the id of the element of a picture that stands for a line: the innermost one. */
export function atLine(
  items: Record<string, Item>, uri: string, line: number,
): string | undefined {
  let found: string | undefined;
  let best = -1;
  for (const [id, item] of Object.entries(items)) {
    if (item.uri === uri && item.kind === "state" && item.line <= line && item.line > best) {
      found = id;
      best = item.line;
    }
  }
  return found;
}

/** Return the page. `source` is where its script may come from, `nonce` what marks the script. */
export function html(source: string, script: string, nonce: string): string {
  const policy = `default-src 'none'; img-src ${source}; style-src 'nonce-${nonce}'; `
    + `script-src 'nonce-${nonce}'`;
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="${policy}">
<style nonce="${nonce}">
html, body { height: 100%; margin: 0; background: white; }
@media (prefers-color-scheme: dark) { html, body { background: #1c232a; } }
#note { position: fixed; left: 0; right: 0; padding: 4px 8px; background: #fff3cd; color: #533f03; font: 13px sans-serif; }
#picture { overflow: auto; height: 100%; }
#picture svg { transform-origin: 0 0; }
.marked > * { stroke-width: 3px; }
</style>
</head>
<body>
<div id="note" hidden></div>
<div id="picture"></div>
<script nonce="${nonce}" src="${script}"></script>
</body>
</html>`;
}
