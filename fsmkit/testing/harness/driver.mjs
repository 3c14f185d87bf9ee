// Runs machines by scripts that `harness.py` prepared, and prints their traces as JSON.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const LARGEST_RANGE = 2n ** 22n;

function read(value) {
  if (Array.isArray(value)) return value.map(read);
  if (value === null || typeof value !== "object") return value;
  return "big" in value ? BigInt(value.big) : Number(value.float);
}

/** Operations that return pseudo-random values, the same as in all harnesses. */
class SeededHost {
  constructor(results) {
    this.state = 1n;
    this.calls = 0; // up to and including the one that posts
    this.post = () => {};
    this.given = new Map(); // of operations: the results, one a call; the last one stays
    for (const [name, type, listed] of results) {
      const values = listed.map(read);
      Object.defineProperty(this, name, { value: () => this.answer(name, type, values) });
    }
  }

  /** Returns the result of a call, in which the host may post an event. */
  answer(name, type, listed) {
    if (this.calls > 0 && --this.calls === 0) this.post();
    const given = this.given.get(name);
    if (given !== undefined) return given.length > 1 ? given.shift() : given[0];
    if (listed.length > 0) return listed[Number((this.next() >> 8n) % BigInt(listed.length))];
    return type === null ? undefined : this.value(type);
  }

  next() {
    this.state = (1103515245n * this.state + 12345n) % 2n ** 31n;
    return this.state;
  }

  value(type) {
    const [kind, ...more] = type;
    if (kind === "parts") return more.map((part) => this.value(part));
    const x = this.next() >> 8n;
    switch (kind) {
      case "bool":
        return Number((this.state >> 16n) & 1n) === 1;
      case "int": {
        const [lo, hi, isBig] = more;
        const size = BigInt(hi) - BigInt(lo) + 1n;
        const value = BigInt(lo) + (x % (size < LARGEST_RANGE ? size : LARGEST_RANGE));
        return isBig ? value : Number(value);
      }
      case "enum":
        return more[Number(x % BigInt(more.length))];
      case "duration":
        return Number(x % 1001n);
      case "float":
        return (Number(x % 2001n) - 1000) / 8;
      default:
        return "";
    }
  }
}

class Driven {
  constructor(Class, job, told) {
    this.job = job;
    this.Class = Class;
    this.told = told;
    this.host = new SeededHost(job.results);
    this.machine = this.made();
  }

  made() {
    const machine = new this.Class(this.host);
    if (this.told !== null) machine.trace = (line) => this.told.push(line);
    return machine;
  }

  tell(line) {
    if (this.told !== null) this.told.push(line);
  }

  obey({ verb, number, event, name, payload, value, reply, data, shown: words }, shown) {
    const { machine } = this;
    switch (verb) {
      case "start":
        machine.start(number);
        break;
      case "run":
        machine.run(number);
        break;
      case "post":
        if (!machine.post(event, ...payload.map(read))) this.tell("full queue");
        break;
      case "dispatch":
        machine.dispatch(event, ...payload.map(read));
        break;
      case "ask": {
        if (!machine.running) {
          this.tell("answer stopped");
          break;
        }
        const answer = ["answer", machine.dispatch(event, ...payload.map(read)) ? "handled" : "ignored"];
        if (reply !== null) answer.push(shown(machine.reply ?? reply));
        this.tell(answer.join(" "));
        break;
      }
      case "input":
        machine.inputs[name] = read(value);
        break;
      case "within":
        this.host.calls = number;
        this.host.post = () => {
          const fits = this.machine.post(event, ...payload.map(read));
          this.tell(`${fits ? "post" : "reject"} ${words}`);
        };
        break;
      case "returns":
        this.host.given.set(name, payload.map(read));
        break;
      case "seed":
        this.host.state = BigInt(number);
        break;
      case "dump":
        dump(machine, this.job.variables, "", shown).forEach((line) => this.tell(line));
        break;
      case "save":
        this.saved = machine.save();
        this.tell(`saved ${Buffer.from(this.saved).toString("hex")}`);
        break;
      case "restore":
        this.machine = this.made();
        if (data) this.saved = Buffer.from(data, "hex");
        try {
          this.machine.restore(this.saved, number);
        } catch (error) {
          if (!(error instanceof RangeError)) throw error;
          this.tell("not restored");
        }
        break;
      default:
        throw new Error(`no line ${verb}`);
    }
  }

  seen(shown) {
    const { machine } = this;
    return JSON.stringify([
      machine.active(), machine.running, machine.finished, machine.fault, machine.nextDeadline(),
      String(this.host.state), dump(machine, this.job.variables, "", shown),
    ]);
  }
}

function dump(machine, { own, invoked }, before, shown) {
  const lines = own.map(([place, name]) => `${before}d ${name} ${shown(machine[place][name])}`);
  invoked.forEach(([id, variables], slot) => {
    const child = machine._slots[slot];
    if (child.running) lines.push(...dump(child, variables, `${before}${id}: `, shown));
  });
  return lines;
}

async function play(job, shown) {
  const module = await import(pathToFileURL(job.file));
  const told = [];
  const traced = new Driven(module[job.class], job, told);
  const untraced = new Driven(module[job.class], job, null);
  for (const line of job.script) {
    traced.obey(line, shown);
    untraced.obey(line, shown);
    const [one, other] = [traced.seen(shown), untraced.seen(shown)];
    if (one !== other) told.push(`without a trace: ${other}, not ${one}`);
  }
  return told;
}

const { runtime, jobs } = JSON.parse(readFileSync(0, "utf8"));
const { shown } = await import(pathToFileURL(runtime));
const traces = [];
for (const job of jobs) {
  try {
    traces.push(await play(job, shown));
  } catch (error) {
    traces.push([`(crashed: ${error.stack})`]);
  }
}
process.stdout.write(JSON.stringify(traces));
