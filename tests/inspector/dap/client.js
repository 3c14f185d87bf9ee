// Microsoft's client of the protocol goes through every request of `fsmkit dap`.
// node client.js MODULES PYTHON ADAPTER.py CHART.yaml; prints what it was answered as JSON.
"use strict";
const assert = require("assert");
const [modules, python, adapter, chart] = process.argv.slice(2);
const { DebugClient } = require(`${modules}/@vscode/debugadapter-testsupport`);

const client = new DebugClient(python, adapter, "fsmkit", { env: process.env }, true);
client.defaultTimeout = 60000;
const told = {};

async function stop(promise, command) {
    const event = client.waitForEvent("stopped");
    await promise();
    const { reason, description } = (await event).body;
    told[command] = [reason, description];
    return reason;
}

async function main() {
    await client.start();
    const lines = require("fs").readFileSync(chart, "utf8").split("\n");
    const line = lines.findIndex((text) => text.includes("T_OPEN: {target")) + 1;
    const initialized = client.waitForEvent("initialized");
    await client.launch({ program: chart, speed: 0 });
    await initialized;
    const source = { path: chart };
    const set = await client.setBreakpointsRequest({ source, breakpoints: [{ line: line - 1 }] });
    told.setBreakpoints = set.body.breakpoints.map((each) => [each.verified, each.line - line]);
    await client.setFunctionBreakpointsRequest({ breakpoints: [{ name: "broken" }] });
    await client.setExceptionBreakpointsRequest({ filters: ["fault", "lost"] });
    await stop(() => client.configurationDone(), "configurationDone");
    told.threads = (await client.threadsRequest()).body.threads.map((thread) => thread.name);
    const stack = (await client.stackTraceRequest({ threadId: 1 })).body.stackFrames;
    told.stackTrace = stack.map((frame) => frame.name);
    const frameId = stack[0].id;
    const scopes = (await client.scopesRequest({ frameId })).body.scopes;
    told.scopes = scopes.map((scope) => scope.name);
    const [data, inputs] = scopes.map((scope) => scope.variablesReference);
    const variables = async (reference) => (await client.variablesRequest({ variablesReference: reference })).body.variables.map((each) => [each.name, each.value]);
    told.variables = await variables(data);
    const set_ = await client.setVariableRequest({ variablesReference: data, name: "count", value: "4" });
    told.setVariable = set_.body.value;
    await client.setVariableRequest({ variablesReference: inputs, name: "blocked", value: "false" });
    const info = (await client.dataBreakpointInfoRequest({ variablesReference: data, name: "fault_code" })).body;
    told.dataBreakpointInfo = info.description;
    await client.setDataBreakpointsRequest({ breakpoints: [{ dataId: info.dataId }] });
    told.evaluate = (await client.evaluateRequest({ expression: "count + 1", frameId })).body.result;
    told.completions = (await client.completionsRequest({ text: "op", column: 3, frameId })).body.targets.map((each) => each.label);
    told.source = (await client.customRequest("loadedSources")).body.sources.map((each) => each.name);
    told.locations = (await client.customRequest("breakpointLocations", { source, line })).body.breakpoints.length;
    await stop(() => client.evaluateRequest({ expression: "open", context: "repl" }), "evaluate open");
    const [hit] = await Promise.all([
        client.assertStoppedLocation("breakpoint", { path: chart, line: lines.findIndex((text) => text === "  wide:") + 1 }),
        client.continueRequest({ threadId: 1 }),
    ]);
    told["continue"] = hit.body.stackFrames[0].name;
    await stop(() => client.stepBackRequest({ threadId: 1 }), "stepBack");
    await stop(() => client.stepInRequest({ threadId: 1 }), "stepIn");
    await stop(() => client.stepOutRequest({ threadId: 1 }), "stepOut");
    await stop(() => client.nextRequest({ threadId: 1 }), "next");
    await stop(() => client.reverseContinueRequest({ threadId: 1 }), "reverseContinue");
    const [top] = (await client.stackTraceRequest({ threadId: 1 })).body.stackFrames;
    await stop(() => client.restartFrameRequest({ frameId: top.id }), "restartFrame");
    told.live = (await client.customRequest("fsmkit/live")).body.address.replace(/:\d+.*/, "");
    await client.pauseRequest({ threadId: 1 });
    await assert.rejects(client.exceptionInfoRequest({ threadId: 1 }), /did not stop/);
    await assert.rejects(client.attachRequest({}), /no session runs/);
    await assert.rejects(client.customRequest("nonsense"), /no request/);
    await assert.rejects(client.evaluateRequest({ expression: "1 +" }), /ends too early/);
    const terminated = client.waitForEvent("terminated");
    await client.terminateRequest({});
    await terminated;
    await client.stop();
    console.log(JSON.stringify(told));
}

main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
