// Which fsmkit is started: that of a setting, of the selected Python environment, or on the path.

import * as path from "node:path";

export interface Command {
  command: string;
  args: string[];
}

/** What is asked of the machine, so that tests can answer. */
export interface Machine {
  platform: string;
  /** The folders of the path. */
  folders: string[];
  isFile(file: string): boolean;
  /** Whether an interpreter can import fsmkit with its server. */
  hasServer(python: string): Promise<boolean>;
}

export interface Settings {
  command: string;
  python: string;
}

/** Return the interpreter that runs when a program of its environment is called `python`. */
function beside(python: string, machine: Machine): string | undefined {
  const name = machine.platform === "win32" ? "fsmkit.exe" : "fsmkit";
  const file = path.join(path.dirname(python), name);
  return machine.isFile(file) ? file : undefined;
}

/**
 * Return what starts the server; undefined where there is no fsmkit.
 *
 * `selected`: the interpreter that the Python extension has selected for the folder, if there is one.
 */
export async function find(
  settings: Settings, selected: string | undefined, machine: Machine,
): Promise<Command | undefined> {
  if (settings.command !== "") {
    return { command: settings.command, args: ["lsp"] };
  }
  for (const python of [settings.python, selected]) {
    if (python === undefined || python === "") {
      continue;
    }
    if (await machine.hasServer(python)) {
      const file = beside(python, machine);
      return file !== undefined
        ? { command: file, args: ["lsp"] }
        : { command: python, args: ["-m", "fsmkit", "lsp"] };
    }
  }
  const names = machine.platform === "win32" ? ["fsmkit.exe", "fsmkit.cmd"] : ["fsmkit"];
  for (const folder of machine.folders) {
    for (const name of names) {
      const file = path.join(folder, name);
      if (folder !== "" && machine.isFile(file)) {
        return { command: file, args: ["lsp"] };
      }
    }
  }
  return undefined;
}
