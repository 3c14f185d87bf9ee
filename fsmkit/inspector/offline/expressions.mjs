// Expressions of the data language that someone types in a page: read, typed, evaluated. Nothing is
// evaluated as JavaScript. Integers are BigInt throughout, so every result is exact; types and
// results are those of fsmkit.language. Bit operators, choices, literals of arrays, arithmetic of
// durations and dialects of ECMAScript are rejected.

import { ContentError, RangeFault, divide, remainder } from "./fsmkit_runtime.mjs";
import { partTypes } from "./fsmkit_system.mjs";
import { LONGEST_DURATION, numberOf, toJson } from "./live.mjs";

const MOST_CHARACTERS = 2000;
const DEEPEST = 90;
const TOKEN = /\s*(?:(\d+(?:\.\d*)?|\.\d+)(us|ms|s|m|h|d)(?![\w$])|(0[xX][0-9a-fA-F]+|0[bB][01]+|0[oO][0-7]+|(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+|\d+)|([\p{L}_][\p{L}\p{N}_$]*|\$[\w$]*)|("[^"\\\n]*"|'[^'\\\n]*')|(<<|>>|\*\*|===|!==|==|!=|<=|>=|&&|\|\||\/\/|[-+*/%()[\].,<>!])|(\S))/uy;
const UNITS = { us: 1, ms: 1e3, s: 1e6, m: 6e7, h: 3.6e9, d: 8.64e10 };
const RESULTS = [["int32", -(2n ** 31n), 2n ** 31n - 1n], ["uint32", 0n, 2n ** 32n - 1n], ["int64", -(2n ** 63n), 2n ** 63n - 1n], ["uint64", 0n, 2n ** 64n - 1n]];
const [LEAST, GREATEST] = [RESULTS[2][1], RESULTS[3][2]];
const BOOL = { kind: "bool", name: "bool" };
const FLOAT = { kind: "float", name: "float64" };
const SYMBOL = { kind: "symbol", name: "symbol" };
const DURATION = { kind: "duration", name: "duration" };

/** An error in an expression: a rule of fsmkit, and the reason. */
export class ExpressionError extends Error {
  constructor(rule, message, help = "") {
    super(message);
    this.rule = rule;
    this.help = help;
  }
}

function refuse(rule, message, help) {
  throw new ExpressionError(rule, message, help);
}

function unsupported(what) {
  refuse("wrong-command", `a page does not evaluate ${what}`, "use `fsmkit serve`, which does");
}

// --- types ----------------------------------------------------------------------------------------

function whole(lo, hi) {
  if (lo < LEAST || hi > GREATEST || (lo < 0n && hi > RESULTS[2][2])) {
    refuse("integer-too-wide", `the result lies in ${lo}..${hi}, beyond 64 bits`);
  }
  return { kind: "int", name: `${lo}..${hi}`, lo, hi, isMachine: false };
}

function machine(...types) {
  const lo = types.map((type) => type.lo).reduce((a, b) => (a < b ? a : b));
  const hi = types.map((type) => type.hi).reduce((a, b) => (a > b ? a : b));
  const found = RESULTS.find(([, low, high]) => low <= lo && hi <= high);
  if (!found) refuse("integer-too-wide", `no machine integer holds both ${types.map((type) => `\`${type.name}\``).join(" and ")}`);
  return { kind: "int", name: found[0], lo: found[1], hi: found[2], isMachine: true };
}

function wrapped(value, { lo, hi, isMachine }) {
  if (!isMachine) return value;
  const size = hi - lo + 1n, rest = (value - lo) % size;
  return (rest < 0n ? rest + size : rest) + lo;
}

/** A type of a description as expressions have it: its ends are BigInt. */
function meant(type) {
  if (type.kind !== "int") return type;
  const [lo, hi] = [type.lo, type.hi].map((end) => BigInt(typeof end === "object" ? end.int : end));
  return { kind: "int", name: type.name, lo, hi, isMachine: /^u?int(8|16|32|64)$/.test(type.name) };
}

function described(type) {
  if (type.kind === "int" && type.lo === type.hi) return `the number ${type.lo}`;
  return type.kind === "symbol" ? "a symbol" : `\`${type.name}\``;
}

/** A value as a machine holds it, as expressions compute of it. */
function raised(value, type) {
  return type.kind === "int" ? BigInt(value) : value;
}

// --- reading and typing -----------------------------------------------------------------------------
// A node is its type and a function from snapshots to its value.

class Reader {
  constructor(text, scope) {
    this.scope = scope;
    this.tokens = [];
    this.at = 0;
    this.depth = 0;
    TOKEN.lastIndex = 0;
    for (let found; TOKEN.lastIndex < text.trimEnd().length && (found = TOKEN.exec(text));) {
      const [, duration, unit, number, name, string, sign, other] = found;
      if (other !== undefined) {
        if ("&|^~?".includes(other)) unsupported("bit operators and choices");
        refuse("expression-syntax", `\`${other}\` does not fit here`);
      }
      if (duration !== undefined) this.tokens.push({ kind: "duration", text: duration + unit, us: Number(duration) * UNITS[unit] });
      else if (number !== undefined) this.tokens.push({ kind: "number", text: number });
      else if (name !== undefined) this.tokens.push({ kind: "name", text: name });
      else if (string !== undefined) this.tokens.push({ kind: "string", text: string });
      else if (["<<", ">>", "**"].includes(sign)) unsupported("bit operators and powers");
      else this.tokens.push({ kind: "sign", text: sign });
    }
  }

  get next() {
    return this.tokens[this.at] ?? { kind: "end", text: "the end" };
  }

  is(...texts) {
    const { kind, text } = this.next;
    return (kind === "sign" || kind === "name") && texts.includes(text);
  }

  take(...texts) {
    if (!this.is(...texts)) return null;
    this.at += 1;
    return this.tokens[this.at - 1].text;
  }

  need(text) {
    if (this.take(text) === null) refuse("expression-syntax", `\`${text}\` is missing before \`${this.next.text}\``);
  }

  name() {
    if (this.next.kind !== "name") refuse("expression-syntax", `a name is missing before \`${this.next.text}\``);
    this.at += 1;
    return this.tokens[this.at - 1].text;
  }

  whole() {
    if (!this.tokens.length) refuse("expression-syntax", "the expression is empty");
    const found = this.either();
    if (this.is("if")) unsupported("choices");
    if (this.next.kind !== "end") refuse("expression-syntax", `\`${this.next.text}\` does not fit here`);
    return found;
  }

  chain(below, signs, combine) {
    this.depth += 1;
    if (this.depth > DEEPEST) refuse("expression-too-deep", "the expression nests too deeply");
    let left = below.call(this);
    for (let count = 0, sign; (sign = this.take(...signs)) !== null; count += 1) {
      if (count > DEEPEST) refuse("expression-too-deep", "the expression nests too deeply");
      left = combine.call(this, sign, left, below.call(this));
    }
    this.depth -= 1;
    return left;
  }

  either() {
    return this.chain(this.both, ["or", "||"], (sign, a, b) => logic(sign, a, b, (s) => a.value(s) || b.value(s)));
  }

  both() {
    return this.chain(this.denied, ["and", "&&"], (sign, a, b) => logic(sign, a, b, (s) => a.value(s) && b.value(s)));
  }

  denied() {
    let times = 0;
    while (this.take("not") !== null) times += 1;
    const inner = this.equality();
    return times ? negated(inner, times) : inner;
  }

  equality() {
    return this.chain(this.relation, ["===", "!==", "==", "!="], comparison);
  }

  relation() {
    return this.chain(this.sum, ["<=", ">=", "<", ">"], comparison);
  }

  sum() {
    return this.chain(this.product, ["+", "-"], arithmetic);
  }

  product() {
    return this.chain(this.prefix, ["*", "/", "//", "%"], arithmetic);
  }

  prefix() {
    const signs = [];
    for (let sign; (sign = this.take("-", "+", "!")) !== null;) signs.push(sign);
    if (signs.length > DEEPEST) refuse("expression-too-deep", "the expression nests too deeply");
    return signs.reduceRight((inner, sign) => (sign === "!" ? negated(inner, 1) : signed(sign, inner)), this.postfix());
  }

  postfix() {
    let found = this.atom();
    for (;;) {
      if (this.take("[") !== null) {
        const index = this.either();
        this.need("]");
        found = element(found, index);
      } else if (this.take(".") !== null) {
        found = part(found, this.name());
      } else {
        return found;
      }
    }
  }

  atom() {
    const { kind, text, us } = this.next;
    this.at += 1;
    switch (kind) {
      case "number":
        return number(text);
      case "duration": {
        const ticks = us / this.scope.tick;
        if (!Number.isInteger(ticks) || ticks > LONGEST_DURATION) refuse("invalid-duration", `\`${text}\` is no duration of whole ticks`);
        return constant(DURATION, ticks);
      }
      case "string":
        return constant(SYMBOL, text.slice(1, -1));
      case "name":
        return this.named(text);
      default:
        if (text === "(" && kind === "sign") {
          const inner = this.either();
          this.need(")");
          return { ...inner, isComparison: false };
        }
        if (text === "[" && kind === "sign") unsupported("literals of arrays");
        return refuse("expression-syntax", `a value is missing before \`${text}\``);
    }
  }

  named(name) {
    if (/^([Tt]rue|[Ff]alse)$/.test(name)) return constant(BOOL, name.toLowerCase() === "true");
    if (["min", "max", "abs"].includes(name) && this.take("(") !== null) return this.applied(name);
    const found = this.scope.variable(name) ?? this.scope.constant(name) ?? this.scope.member(name, this);
    if (found !== null) return found;
    if (name === "In" && this.scope.isIn !== null && this.take("(") !== null) return this.scope.isIn(this.stateName());
    if (name === "event" || name === "_event") refuse("wrong-command", "no event is at hand between steps", "use variables and `In`");
    return this.scope.machine(name, this) ?? refuse("unknown-name", `\`${name}\` is not declared`, "use a variable, a constant, or `In(state)`");
  }

  /** The name of a state up to the parenthesis that closes: tokens joined, or a string. */
  stateName() {
    if (this.next.kind === "string") {
      this.at += 1;
      const { text } = this.tokens[this.at - 1];
      this.need(")");
      return text.slice(1, -1);
    }
    let name = "";
    while (this.next.kind !== "end" && !this.is(")")) {
      name += this.next.text;
      this.at += 1;
    }
    this.need(")");
    return name;
  }

  applied(name) {
    const parts = [this.either()];
    while (this.take(",") !== null) parts.push(this.either());
    this.need(")");
    if ((parts.length === 1) !== (name === "abs")) refuse("wrong-arguments", `\`${name}\` takes another number of operands`);
    for (const { type } of parts) {
      if (!["int", "float", "duration"].includes(type.kind)) refuse("type-mismatch", `\`${name}\` does not apply to ${described(type)}`);
      if (type.kind !== "int") unsupported(`\`${name}\` of anything but integers`);
    }
    const types = parts.map(({ type }) => type);
    const isWrapping = types.some((type) => type.isMachine);
    if (name === "abs") {
      const { lo, hi } = types[0];
      const [low, high] = [lo < 0n ? -lo : lo, hi < 0n ? -hi : hi];
      const least = lo <= 0n && hi >= 0n ? 0n : low < high ? low : high;
      const type = isWrapping ? machine(types[0]) : whole(least, low > high ? low : high);
      return { type, value: (s) => { const a = parts[0].value(s); return wrapped(a < 0n ? -a : a, type); } };
    }
    const pick = name === "min" ? (a, b) => (b < a ? b : a) : (a, b) => (b > a ? b : a);
    const isOne = types.every((type) => type.name === types[0].name);
    const ends = (end) => types.map((type) => type[end]).reduce(pick);
    const type = isOne ? types[0] : isWrapping ? machine(...types) : whole(ends("lo"), ends("hi"));
    return { type, value: (s) => parts.map((each) => each.value(s)).reduce(pick) };
  }
}

function constant(type, value) {
  return { type, value: () => value, isConstant: true };
}

function number(text) {
  if (/^\d*\.|^\d+[eE]|\.\d*$/.test(text)) return constant(FLOAT, Number(text));
  if (/^0\d+$/.test(text) && /[1-9]/.test(text)) refuse("expression-syntax", `\`${text}\` may be meant as octal`);
  const value = BigInt(text);
  return constant(whole(value, value), value);
}

function needBool({ type }, what) {
  if (type.kind !== "bool") refuse("type-mismatch", `${what} is ${described(type)}, no \`bool\``, "compare it with something");
}

function logic(sign, left, right, value) {
  needBool(left, `the left operand of \`${sign}\``);
  needBool(right, `the right operand of \`${sign}\``);
  return { type: BOOL, value };
}

function negated(inner, times) {
  needBool(inner, "the operand of `!`");
  return { type: BOOL, value: (s) => inner.value(s) === (times % 2 === 0) };
}

function signed(sign, inner) {
  const { type } = inner;
  if (type.kind === "float") return sign === "+" ? inner : { ...inner, type: FLOAT, value: (s) => -inner.value(s) };
  if (type.kind !== "int") refuse("type-mismatch", `\`${sign}\` does not apply to ${described(type)}`);
  if (sign === "+") return inner;
  const result = type.isMachine ? machine(type) : whole(-type.hi, -type.lo);
  return { ...inner, type: result, value: (s) => wrapped(-inner.value(s), result) };
}

function real({ type, value }) {
  return type.kind === "int" ? (s) => Number(value(s)) : value;
}

function isNumber({ type }) {
  return type.kind === "int" || type.kind === "float";
}

function comparison(sign, left, right) {
  if (left.isComparison || right.isComparison) refuse("chained-comparison", "comparisons do not chain", "join them with `and`, or put parentheses");
  const [a, b] = [left.type, right.type];
  let [one, other] = [left.value, right.value];
  const isEquality = "=!".includes(sign[0]);
  if (isNumber(left) && isNumber(right)) {
    if (a.kind !== b.kind) [one, other] = [real(left), real(right)];
  } else if (a.kind !== b.kind || a.name !== b.name || !["bool", "enum", "symbol", "duration"].includes(a.kind)) {
    refuse("type-mismatch", `${described(a)} cannot be compared with ${described(b)}`, "compare values of one type");
  } else if (!isEquality && a.kind !== "duration") {
    refuse("type-mismatch", `\`${sign}\` does not apply to ${described(a)}`, "only `==` and `!=` do");
  }
  const compare = {
    "=": (x, y) => x === y, "!": (x, y) => x !== y, "<": (x, y) => x < y, "<=": (x, y) => x <= y, ">": (x, y) => x > y, ">=": (x, y) => x >= y,
  }[isEquality ? sign[0] : sign];
  return { type: BOOL, value: (s) => compare(one(s), other(s)), isComparison: true };
}

function arithmetic(sign, left, right) {
  if (sign === "//") unsupported("`//`");
  const [a, b] = [left.type, right.type];
  if (a.kind === "duration" || b.kind === "duration") unsupported("arithmetic of durations");
  if (!isNumber(left) || !isNumber(right)) refuse("type-mismatch", `\`${sign}\` does not apply to ${described(a)} and ${described(b)}`);
  if (a.kind === "float" || b.kind === "float") {
    if (sign === "%") refuse("type-mismatch", "`%` does not apply to floating-point numbers");
    const [one, other] = [real(left), real(right)];
    const compute = { "+": (x, y) => x + y, "-": (x, y) => x - y, "*": (x, y) => x * y, "/": (x, y) => x / y }[sign];
    return { type: FLOAT, value: (s) => compute(one(s), other(s)) };
  }
  if ("/%".includes(sign) && b.lo === 0n && b.hi === 0n) refuse("division-by-zero", "the divisor is always 0", "divide by something else");
  const type = a.isMachine || b.isMachine ? machine(a, b) : interval(sign, a, b);
  const compute = { "+": (x, y) => x + y, "-": (x, y) => x - y, "*": (x, y) => x * y, "/": divide, "%": remainder }[sign];
  return { type, value: (s) => wrapped(compute(left.value(s), right.value(s)), type) };
}

const leastOf = (values) => values.reduce((a, b) => (a < b ? a : b));
const greatestOf = (values) => values.reduce((a, b) => (a > b ? a : b));

/** The interval of the exact results of an operator: as fsmkit.language.arithmetic. */
function interval(sign, a, b) {
  const size = (value) => (value < 0n ? -value : value);
  switch (sign) {
    case "+":
      return whole(a.lo + b.lo, a.hi + b.hi);
    case "-":
      return whole(a.lo - b.hi, a.hi - b.lo);
    case "%": {
      const most = greatestOf([size(b.lo), size(b.hi)]) - 1n;
      const least = b.lo <= 0n && b.hi >= 0n ? 0n : leastOf([size(b.lo), size(b.hi)]);
      if (greatestOf([size(a.lo), size(a.hi)]) < least) return whole(a.lo, a.hi);
      return whole(-leastOf([most, greatestOf([-a.lo, 0n])]), leastOf([most, greatestOf([a.hi, 0n])]));
    }
    default: {
      const others = sign === "*" ? [b.lo, b.hi] : [b.lo, -1n, 1n, b.hi].filter((d) => d !== 0n && b.lo <= d && d <= b.hi);
      const corners = [a.lo, a.hi].flatMap((x) => others.map((y) => (sign === "*" ? x * y : x / y)));
      return whole(leastOf(corners), greatestOf(corners));
    }
  }
}

function element(array, index) {
  const { type } = array;
  if (type === undefined || type.kind !== "array") refuse("type-mismatch", "only arrays have elements");
  if (index.type.kind !== "int") refuse("type-mismatch", `an index is ${described(index.type)}, no integer`);
  const of = meant(type.of);
  const isKnown = index.isConstant && (index.type.lo < 0n || index.type.lo >= type.length);
  if (isKnown) refuse("index-out-of-range", `index ${index.type.lo} is outside 0..${type.length - 1}`);
  const value = (s) => {
    const at = index.value(s);
    if (at < 0n || at >= type.length) throw new ContentError(`index ${at} is outside 0..${type.length - 1}`);
    return raised(array.value(s)[at], of);
  };
  return { type: of, value };
}

function part(record, name) {
  const { type } = record;
  const at = type.kind === "record" ? type.fields.findIndex((field) => field.name === name) : -1;
  if (at < 0) refuse("unknown-name", `${described(type)} has no \`${name}\``);
  const of = meant(type.fields[at].type);
  return { type: of, value: (s) => raised(record.value(s)[at], of) };
}

// --- names ----------------------------------------------------------------------------------------------

/** Return the names of one machine. */
function ownScope(simulation, machine) {
  const { chart } = simulation.machines[machine];
  const { states } = simulation.definition(machine);
  return {
    tick: simulation.system.tick,
    variable: (name) => variableOf(chart, machine, name),
    constant: (name) => constantOf([chart], name),
    member: (name, reader) => memberOf([chart], name, reader),
    isIn: (state) => stateOf(states, machine, state, chart.name),
    machine: () => null,
  };
}

/** Return the names of all machines: `machine.name`, shared variables, and constants that are of one meaning. */
function sharedScope(simulation) {
  const charts = simulation.machines.map(({ chart }) => chart);
  const shared = (name) => {
    for (const [place, { chart, shared: slots }] of simulation.machines.entries()) {
      const own = slots.filter((slot) => chart.data[slot.data].name === name);
      if (!own.length) continue;
      if (own.some(({ element }) => element !== null) && own.length < chart.data[own[0].data].type.length) unsupported("shared arrays of which machines hold parts");
      return variableOf(chart, place, name);
    }
    return null;
  };
  return {
    tick: simulation.system.tick,
    variable: shared,
    constant: (name) => constantOf(charts, name),
    member: (name, reader) => memberOf(charts, name, reader),
    isIn: null,
    machine(name, reader) {
      let whole = name;
      if (reader.is("[") && reader.tokens[reader.at + 1]?.kind === "number") {
        whole = `${name}[${reader.tokens[reader.at + 1].text}]`;
        reader.at += 2;
        reader.need("]");
      }
      const place = simulation.machines.findIndex((each) => each.name === whole);
      if (place < 0) return null;
      reader.need(".");
      const { chart } = simulation.machines[place];
      const inner = reader.name();
      if (inner === "In" && reader.take("(") !== null) return stateOf(simulation.definition(place).states, place, reader.stateName(), whole);
      return variableOf(chart, place, inner) ?? refuse("unknown-name", `\`${whole}\` has no variable \`${inner}\``);
    },
  };
}

function variableOf(chart, machine, name) {
  for (const place of ["data", "outputs", "inputs"]) {
    const declared = chart[place].find((each) => each.name === name);
    if (declared === undefined) continue;
    const type = meant(declared.type);
    return { type, value: (snapshots) => raised(snapshots[machine][place][name], type) };
  }
  return null;
}

function stateOf(states, machine, name, whose) {
  const state = states.findIndex(({ id, kind }, index) => index > 0 && id === name && !kind.endsWith("history"));
  if (state < 0) refuse("unknown-name", `\`${whose}\` has no state \`${name}\``);
  return { type: BOOL, value: (snapshots) => snapshots[machine].active[state] };
}

function constantOf(charts, name) {
  const found = charts.flatMap(({ typedConstants }) => typedConstants.filter((each) => each.name === name));
  if (!found.length) return null;
  if (found.some((each) => JSON.stringify(each) !== JSON.stringify(found[0]))) return null;
  const type = meant(found[0].type), { value } = found[0];
  if (type.kind === "int") return constant(type, BigInt(typeof value === "object" ? value.int : value));
  if (type.kind === "enum") return constant(type, numberOf(type, value));
  if (["array", "record"].includes(type.kind)) unsupported("constants that are arrays or records");
  return constant(type, typeof value === "object" ? { nan: NaN, inf: Infinity, "-inf": -Infinity }[value.float] : value);
}

function memberOf(charts, name, reader) {
  const found = charts.flatMap(({ types }) => types.filter((each) => each.kind === "enum" && each.name === name));
  if (!found.length) return null;
  if (found.some((each) => each.members.join() !== found[0].members.join())) return null;
  reader.need(".");
  const member = reader.name();
  const at = found[0].members.indexOf(member);
  if (at < 0) refuse("unknown-name", `\`${name}\` has no member \`${member}\``, `use one of ${found[0].members.join(", ")}`);
  return constant(found[0], numberOf(found[0], member));
}

// --- interface -------------------------------------------------------------------------------------

/** Read an expression; `machine`: whose names it has, null: names are `machine.name`. */
export function read(simulation, text, machine, isCondition) {
  if (text.length > MOST_CHARACTERS) refuse("wrong-command", `the expression has more than ${MOST_CHARACTERS} characters`);
  const scope = machine === null ? sharedScope(simulation) : ownScope(simulation, machine);
  const found = new Reader(text, scope).whole();
  if (isCondition && found.type.kind !== "bool") {
    refuse("type-mismatch", `${described(found.type)} where \`bool\` is expected`, "write the comparison that is meant, such as `!= 0`");
  }
  return found;
}

/** Whether a condition holds; one that cannot be evaluated does not. */
export function holds({ value }, snapshots) {
  try {
    return value(snapshots);
  } catch (error) {
    if (error instanceof ContentError || error instanceof RangeFault) return false;
    throw error;
  }
}

/** Whether an expression has the same value twice; to have none is one, by its reason. */
export function isUnchanged({ value }, before, after) {
  const [one, other] = [before, after].map((snapshots) => {
    try {
      return value(snapshots);
    } catch (error) {
      if (error instanceof ContentError || error instanceof RangeFault) return error.message;
      throw error;
    }
  });
  const isSame = (a, b) => Object.is(a, b) || (Array.isArray(a) && a.every((part, at) => isSame(part, b[at])));
  return isSame(one, other);
}

/** The value of an expression in words, or why it has none; `tick` in microseconds. */
export function shownText({ type, value }, snapshots, tick) {
  try {
    return inWords(value(snapshots), type, tick);
  } catch (error) {
    if (error instanceof ContentError || error instanceof RangeFault) return `<${error.message}>`;
    throw error;
  }
}

/** A value as `fsmkit.language.values.show` has it. */
function inWords(value, type, tick) {
  const types = partTypes(type);
  if (types !== null) return `[${value.map((part, at) => inWords(part, types[at], tick)).join(" ")}]`;
  switch (type.kind) {
    case "enum":
      return toJson(value, type);
    case "duration":
      return durationText(value * tick);
    case "float":
      return floatText(value);
    case "symbol":
      return `"${value}"`;
    default:
      return String(value);
  }
}

function durationText(us) {
  if (us >= 1e6 && us % 1000 === 0) return `${us / 1e6}s`;
  return us % 1000 === 0 ? `${us / 1000}ms` : `${us}us`;
}

/** A number as Python writes it: the fewest digits that are read back as it. */
function floatText(value) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value < 0 ? "-inf" : "inf";
  if (Object.is(value, -0)) return "-0.0";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e16)) {
    const [digits, power] = value.toExponential().split("e");
    return `${digits}e${power[0]}${power.slice(1).padStart(2, "0")}`;
  }
  return Number.isInteger(value) ? `${value}.0` : String(value);
}

/** The value of an expression for a client, or why it has none. */
export function shownValue({ type, value }, snapshots) {
  try {
    return { value: toJson(value(snapshots), type), type: type.name };
  } catch (error) {
    if (error instanceof ContentError) return { error: error.message };
    throw error;
  }
}
