// The history: each entry's messages, and moments from which any entry can be recomputed. As
// fsmkit/inspector/history.py.

export const EVERY = 64;
export const LIMIT = 64e6;
const MOST_BRANCHES = 32;

class Branch {
  constructor(first, texts, moments, actions, size = 0) {
    this.first = first;
    this.texts = texts;
    this.moments = moments;
    this.actions = actions;
    this.size = size;
  }

  get head() {
    return this.first + this.texts.length - 1;
  }
}

function since(entries, first) {
  return new Map([...entries].filter(([n]) => n >= first));
}

/** The branch that grows, and those that were left. */
export class History {
  constructor(moment, limit = LIMIT) {
    this.limit = limit;
    this.number = 0;
    this.branch = new Branch(0, [""], new Map([[0, moment]]), new Map());
    this.others = new Map();
    this.next = 1;
  }

  get first() {
    return this.branch.first;
  }

  get head() {
    return this.branch.head;
  }

  /** Append an entry, after which it is that moment; one that no step leads to has an action. */
  add(moment, text, action = null) {
    const { branch } = this;
    branch.texts.push(text);
    branch.size += text.length;
    if (action !== null) branch.actions.set(branch.head, action);
    if (action !== null || branch.head % EVERY === 0) branch.moments.set(branch.head, moment);
    while (branch.size > this.limit && branch.texts.length > 2 * EVERY) this.dropOldest();
    return branch.head;
  }

  /** The last moment that is kept up to an entry, and its number. */
  before(n) {
    let found = n;
    while (!this.branch.moments.has(found)) found -= 1;
    return [found, this.branch.moments.get(found)];
  }

  /** The messages of entries. */
  texts(first, last) {
    const { branch } = this;
    const from = Math.max(first, branch.first) - branch.first, to = Math.min(last, branch.head) - branch.first + 1;
    return branch.texts.slice(from, Math.max(from, to)).filter((text) => text);
  }

  /** Start a branch after an entry; later entries remain as another branch. */
  cut(n, moment) {
    const old = this.branch;
    if (n === old.head) return;
    const texts = old.texts.slice(0, n - old.first + 1);
    this.others.set(this.number, old);
    const moments = new Map([...old.moments].filter(([at]) => at < n)).set(n, moment);
    const actions = new Map([...old.actions].filter(([at]) => at <= n));
    this.branch = new Branch(old.first, texts, moments, actions, texts.reduce((sum, text) => sum + text.length, 0));
    this.number = this.next;
    this.next += 1;
    this.dropBranches();
  }

  /** Take another branch into view. */
  switch(number) {
    this.others.set(this.number, this.branch);
    this.branch = this.others.get(number);
    this.others.delete(number);
    this.number = number;
    this.dropBranches();
  }

  dropBranches() {
    const size = () => [...this.others.values()].reduce((sum, branch) => sum + branch.size, 0);
    while (this.others.size > MOST_BRANCHES || size() > this.limit) this.others.delete(Math.min(...this.others.keys()));
  }

  dropOldest() {
    const { branch } = this;
    const until = Math.min(...[...branch.moments.keys()].filter((n) => n > branch.first));
    const gone = branch.texts.splice(0, until - branch.first);
    branch.size -= gone.reduce((sum, text) => sum + text.length, 0);
    branch.first = until;
    branch.moments = since(branch.moments, until);
    branch.actions = since(branch.actions, until);
  }
}
