// Microsoft's client steps through the counterexample of a mutant of the Production Cell.
// node m5.js MODULES PYTHON ADAPTER.py TRACE.json; prints a transcript as JSON.
"use strict";
const path = require("path");
const [modules, python, adapter, trace] = process.argv.slice(2);
const { DebugClient } = require(`${modules}/@vscode/debugadapter-testsupport`);

const client = new DebugClient(python, adapter, "fsmkit", { env: process.env }, true);
client.defaultTimeout = 60000;
const transcript = [];
let feeder = 0;

async function stop(command, request) {
    const stopped = client.waitForEvent("stopped");
    await request();
    const { reason, description, text } = (await stopped).body;
    if (!feeder) feeder = (await client.threadsRequest()).body.threads.find((each) => each.name === "feeder").id;
    const [top] = (await client.stackTraceRequest({ threadId: feeder, levels: 1 })).body.stackFrames;
    transcript.push(`${command}: ${reason}: ${text || description}; feeder ${top.name} ${path.basename(top.source.path)}:${top.line}`);
    return reason;
}

async function main() {
    await client.start();
    const initialized = client.waitForEvent("initialized");
    await client.launch({ program: trace, speed: 0 });
    await initialized;
    await stop("launch", () => client.configurationDone());
    const go = (command) => stop(command, () => client[`${command}Request`]({ threadId: feeder }));
    await client.setFunctionBreakpointsRequest({ breakpoints: [{ name: "feeder.mold_ready" }] });
    while (await go("reverseContinue") !== "step"); // the last stop is the first step
    await go("continue");
    while (await go("next") !== "exception");
    do await go("stepBack"); while (!transcript.at(-1).includes("mold_ready"));
    await go("stepIn");
    await go("continue");
    await client.stop();
    console.log(JSON.stringify(transcript));
}

main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
