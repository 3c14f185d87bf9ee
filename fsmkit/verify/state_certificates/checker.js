// Checks a certificate: a file with all reachable states of a system, written by
// `fsmkit check --certificate`.
//
//     node checker.js CERTIFICATE COMMAND ARGUMENT...
//
// COMMAND performs the steps of one state at a time (steps.py describes its lines); `%options%` in an
// argument becomes the options of the certificate. This program verifies that
//
// 1. the file is whole: its digest, its counts, the form of each line, no line twice;
// 2. its first line is that of this system, these options and this version;
// 3. the initial states are in the set;
// 4. each step of each state of the set leads to a state of the set;
// 5. no state, and no step, violates a covered property.
//
// It prints one line of JSON: `accepted`, `reason` (why not), and figures. The exit code is 0 for an
// accepted certificate, 1 for a rejected one, 2 for wrong usage.

'use strict';

const {spawn} = require('node:child_process');
const {createHash} = require('node:crypto');
const fs = require('node:fs');
const readline = require('node:readline');

const FORMAT = 'fsmkit-states';
const VERSION = 1;
const STATE = /^\[(?:0|[1-9]\d*)(?:,(?:0|[1-9]\d*))*\]$/;
const PENDING = 512; // requests that wait for an answer

class Rejection extends Error {}

function require_(condition, reason) {
  if (!condition) {
    throw new Rejection(reason);
  }
}

function parsed(line, what) {
  try {
    return JSON.parse(line);
  } catch {
    throw new Rejection(`${what} is not JSON`);
  }
}

/** Yield the lines of a file without their ends, and whether the last one has an end. */
function* linesOf(bytes) {
  let start = 0;
  while (start < bytes.length) {
    const end = bytes.indexOf(10, start);
    require_(end >= 0, 'the last line has no end');
    yield {start, text: bytes.toString('utf8', start, end)};
    start = end + 1;
  }
}

/** Read a certificate; return its header, local states and states. Throws `Rejection`. */
function readCertificate(bytes) {
  const lines = [...linesOf(bytes)];
  require_(lines.length >= 3, 'the file has fewer than three lines');
  const header = parsed(lines[0].text, 'the first line');
  require_(header?.format === FORMAT, `the format is not \`${FORMAT}\``);
  require_(header.version === VERSION, `the version of the format is not ${VERSION}`);
  const last = lines.pop();
  const digest = createHash('sha256').update(bytes.subarray(0, last.start)).digest('hex');
  const counts = parsed(last.text, 'the last line');
  require_(counts?.sha256 === digest, 'the digest in the last line is not that of the file');
  require_(
    Array.isArray(header.machines) && header.machines.length > 0,
    'the first line names no machines',
  );
  const locals = [];
  const tables = header.machines.map(() => 0);
  let place = 1;
  for (; place < lines.length && lines[place].text.startsWith('{'); place += 1) {
    const text = lines[place].text;
    const {machine} = parsed(text, `line ${place + 1}`);
    require_(machine in tables, `line ${place + 1} is of no machine`);
    tables[machine] += 1;
    locals.push(text);
  }
  require_(new Set(locals).size === locals.length, 'a local state is there twice');
  const states = new Set();
  for (; place < lines.length; place += 1) {
    const text = lines[place].text;
    const where = `line ${place + 1}`;
    require_(STATE.test(text), `${where} is not a state`);
    const numbers = JSON.parse(text);
    require_(numbers.length === tables.length, `${where} has not a number for each machine`);
    require_(numbers.every((n, m) => n < tables[m]), `${where} has a number of no local state`);
    require_(!states.has(text), `${where} is there twice`);
    states.add(text);
  }
  const end = JSON.stringify({local_states: locals.length, states: states.size, sha256: digest});
  require_(end === last.text, 'the counts in the last line are not those of the file');
  return {header, firstLine: lines[0].text, locals, states};
}

/** The program that performs steps: each request has one answer, in order. */
class Steps {
  constructor(command, words) {
    this.process = spawn(command, words, {stdio: ['pipe', 'pipe', 'inherit']});
    this.process.stdin.on('error', () => {}); // it ended: `ended` has the reason
    this.waiting = [];
    this.ended = null;
    const output = readline.createInterface({input: this.process.stdout, crlfDelay: Infinity});
    output.on('line', (line) => this.receive(line));
    output.on('close', () => this.end('the program that performs steps ended'));
    this.process.on('error', (error) => this.end(`no steps: ${error.message}`));
  }

  receive(line) {
    const error = line.startsWith('{"error":') ? parsed(line, 'an answer').error : null;
    if (error !== null) {
      this.end(error);
    } else {
      this.waiting.shift()?.resolve(line);
    }
  }

  end(reason) {
    this.ended ??= new Rejection(reason);
    for (const {reject} of this.waiting.splice(0)) {
      reject(this.ended);
    }
  }

  request(line) {
    if (this.ended !== null) {
      return Promise.reject(this.ended);
    }
    return new Promise((resolve, reject) => {
      this.waiting.push({resolve, reject});
      this.process.stdin.write(line + '\n');
    });
  }

  /** Send all lines, some at a time; call `use(line, answer)` for each answer, in order. */
  async requestAll(lines, use) {
    const pending = [];
    const take = async () => {
      const {line, answer} = pending.shift();
      use(line, await answer);
    };
    for (const line of lines) {
      const answer = this.request(line);
      answer.catch(() => {}); // reported where it is awaited
      pending.push({line, answer});
      if (pending.length >= PENDING) {
        await take();
      }
    }
    while (pending.length > 0) {
      await take();
    }
  }

  close() {
    this.process.stdin.end();
    this.process.kill();
  }
}

/** Return why a header is not the one expected. */
function difference(header, expected) {
  const names = {
    fsmkit: 'another version of fsmkit wrote it',
    options: 'its options are not those of this check',
    fingerprint: 'it is about another system or other options',
  };
  for (const [key, reason] of Object.entries(names)) {
    if (JSON.stringify(header[key]) !== JSON.stringify(expected[key])) {
      return reason;
    }
  }
  return 'its first line is not that of this system';
}

/** Check a certificate with a program that performs steps; return figures. Throws `Rejection`. */
async function check(certificate, steps) {
  const {header, firstLine, locals, states} = certificate;
  const expected = await steps.request('header');
  if (expected !== firstLine) {
    throw new Rejection(difference(header, parsed(expected, 'the expected first line')));
  }
  const counts = header.machines.map(() => 0);
  await steps.requestAll(locals, (line, answer) => {
    const {machine} = JSON.parse(line);
    require_(Number(answer) === counts[machine], 'a local state has an unexpected number');
    counts[machine] += 1;
  });
  let taken = 0;
  const requireClosed = (line, answer) => {
    const {to, violated} = parsed(answer, 'an answer');
    const what = line === 'initial' ? 'the start' : `the state ${line}`;
    for (const target of to) {
      taken += 1;
      const reached = JSON.stringify(target);
      require_(states.has(reached), `${what} leads to a state that is missing`);
    }
    if (violated.length > 0) {
      const [name, text] = header.covered[violated[0]];
      throw new Rejection(`${what} violates \`${name}\` (${text})`);
    }
    require_(line !== 'initial' || to.length > 0, 'there is no initial state');
  };
  requireClosed('initial', await steps.request('initial'));
  await steps.requestAll(states, requireClosed);
  return {states: states.size, local_states: locals.length, steps: taken};
}

async function main(words) {
  const [path, command, ...rest] = words;
  if (command === undefined) {
    console.error('usage: node checker.js CERTIFICATE COMMAND ARGUMENT...');
    return 2;
  }
  const start = process.hrtime.bigint();
  let result;
  let steps = null;
  try {
    const certificate = readCertificate(fs.readFileSync(path));
    const options = JSON.stringify(certificate.header.options ?? null);
    steps = new Steps(command, rest.map((word) => word.replaceAll('%options%', () => options)));
    const figures = await check(certificate, steps);
    const {system, options: chosen, covered, not_covered} = certificate.header;
    result = {accepted: true, system, options: chosen, covered, not_covered, ...figures};
  } catch (error) {
    if (!(error instanceof Rejection)) {
      throw error;
    }
    result = {accepted: false, reason: error.message};
  } finally {
    steps?.close();
  }
  const seconds = Number(process.hrtime.bigint() - start) / 1e9;
  console.log(JSON.stringify({...result, seconds: Math.round(seconds * 1000) / 1000}));
  return result.accepted ? 0 : 1;
}

module.exports = {readCertificate};

if (require.main === module) {
  main(process.argv.slice(2)).then((code) => {
    process.exitCode = code;
  });
}
