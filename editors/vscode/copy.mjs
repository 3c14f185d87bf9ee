// Copies what the package shares with fsmkit: the schemas and the licence.

import { copyFileSync, cpSync } from "node:fs";

cpSync("../../fsmkit/editor/schemas/files", "schemas", { recursive: true });
copyFileSync("../../LICENSE", "LICENSE");
