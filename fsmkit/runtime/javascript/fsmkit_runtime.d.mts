// The types common to all generated machines; `Shape` holds those that a chart declares.

/** The declarations of a chart, for the types of its machine. */
export interface Shape {
  /** Events that a host may post: the values that each carries. */
  events: object;
  /** Events that leave the machine: name, values, addressee. */
  sent: readonly unknown[];
  data: object;
  outputs: object;
  inputs: object;
  state: string;
}

type Payload<S extends Shape, E extends keyof S["events"]> = S["events"][E] extends readonly unknown[] ? S["events"][E] : never;

/** A running chart. */
export class Machine<S extends Shape> {
  /** Start or restart at a time in ticks. */
  start(now?: number): void;
  /** Put an event into the queue; false if that is full or the machine does not run. */
  post<E extends keyof S["events"]>(event: E, ...payload: Payload<S, E>): boolean;
  /** Process one event immediately, ahead of the queue; return whether it enabled a transition. */
  dispatch<E extends keyof S["events"]>(event: E, ...payload: Payload<S, E>): boolean;
  /** Process all events and timers up to a time in ticks; return whether the machine still runs. */
  run(now: number): boolean;
  /** Return the first deadline in ticks, or null if no timer is armed. */
  nextDeadline(): number | null;
  /** Return whether a state is active. */
  isIn(state: S["state"]): boolean;
  /** The names of the active atomic states, in document order. */
  active(): S["state"][];
  /** Whether the machine was started and neither finished nor stopped by a fault. */
  get running(): boolean;
  /** Whether the machine ended in a top-level final state. */
  get finished(): boolean;
  /** Why the machine stopped; null if it did not. */
  get fault(): string | null;
  readonly data: Readonly<S["data"]>;
  readonly outputs: Readonly<S["outputs"]>;
  readonly inputs: S["inputs"];
  /** The value of the last `reply` of a dispatched event; null without one. */
  readonly reply: unknown;
  /** Called with event, payload and addressee of each event that is sent out, unless null. */
  send: ((...sent: S["sent"]) => void) | null;
  /** Called with label and values of each `log`, unless null. */
  log: ((label: string, ...values: unknown[]) => void) | null;
  /** Called with each line of the trace, unless null. */
  trace: ((line: string) => void) | null;
}
