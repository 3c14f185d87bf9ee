// Runs machines of the library xstate by scripts: JSON lines in, JSON lines out.
//
// A line of input has `program` (an expression that calls createMachine) or `config` (JSON), and
// `script`: [time, event] pairs. A line of output lists, for each pair, what was logged with its
// time, the active leaves, and whether the machine is done. Times are milliseconds of a simulated
// clock. `tie` says that two timeouts expired at one time, whose order the library leaves open.
import { createRequire } from 'node:module';
import { createInterface } from 'node:readline';

const require = createRequire(process.argv[2] + '/');
const xstate = require('xstate');
const names = ['setup', 'createMachine', 'assign', 'raise', 'cancel', 'log', 'sendTo', 'emit',
  'and', 'or', 'not', 'stateIn'];

class Clock {
  now = 0; timers = new Map(); count = 0; tie = false;
  setTimeout(call, delay) {
    this.timers.set(++this.count, { due: this.now + delay, call });
    return this.count;
  }
  clearTimeout(id) { this.timers.delete(id); }
  advance(to) {
    for (;;) {
      const ready = [...this.timers].filter(([, t]) => t.due <= to).sort((a, b) => a[1].due - b[1].due);
      if (!ready.length) break;
      const [id, first] = ready[0];
      if (ready.length > 1 && ready[1][1].due === first.due) this.tie = true;
      this.timers.delete(id);
      this.now = Math.max(this.now, first.due);
      first.call();
    }
    this.now = to;
  }
}

// The host's answer for a guard: the same for one name, time and number of events.
function answer(name, now, count) {
  let hash = 7;
  for (const char of `${name} ${now} ${count}`) hash = (hash * 31 + char.charCodeAt(0)) % 65521;
  return hash % 3 !== 0;
}

function leaves(value, machine, path = []) {
  if (typeof value === 'string') return [[...path, value].at(-1)];
  const keys = Object.keys(value);
  return keys.length ? keys.flatMap((key) => leaves(value[key], machine, [...path, key])) : [path.at(-1) ?? machine.id];
}

function run(job) {
  const clock = new Clock();
  let lines = [], count = 0;
  const note = (name, params) => lines.push(
    `${clock.now} ${name}${params ? ' ' + JSON.stringify(Object.values(params)) : ''}`);
  const created = job.program
    ? new Function(...names, `return (${job.program})`)(...names.map((name) => xstate[name]))
    : xstate.createMachine(job.config);
  const actions = {}, guards = {};
  for (const name of job.actions) actions[name] = (_, params) => note(name, params);
  for (const name of job.guards) guards[name] = () => answer(name, clock.now, count);
  const machine = created.provide({ actions, guards });
  machine.options.maxIterations = 100; // a machine that never comes to rest is an error
  const actor = xstate.createActor(machine, { clock, logger: () => {} });
  let error = null;
  actor.subscribe({ error: (e) => { error ??= String(e); } });
  const steps = [];
  const look = () => {
    const snapshot = actor.getSnapshot();
    if (snapshot.status === 'error') error ??= String(snapshot.error);
    const done = snapshot.status !== 'active';
    steps.push([...lines, done ? 'done' : leaves(snapshot.value, machine).sort().join(' ')]);
    lines = [];
  };
  actor.start();
  look();
  for (const [time, event] of job.script) {
    clock.advance(time);
    count += 1;
    actor.send(event);
    look();
    if (clock.tie || error) break;
  }
  return { steps, tie: clock.tie, error };
}

for await (const line of createInterface({ input: process.stdin })) {
  let result;
  try { result = run(JSON.parse(line)); } catch (error) { result = { error: String(error) }; }
  process.stdout.write(JSON.stringify(result) + '\n');
}
