// Copies what the package shares with fsmkit: the schema of charts and the licence.

import { copyFileSync } from "node:fs";

copyFileSync("../../fsmkit/yaml/schema.json", "schema.json");
copyFileSync("../../LICENSE", "LICENSE");
