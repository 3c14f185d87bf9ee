"""The reference interpreter: Appendix D of SCXML 1.0 by name, a pure function of a snapshot.

Where the standard leaves a choice, every runtime follows these rules:

* *Run.* If an eventless guard reads an input, `run` first tries the eventless transitions once. An
  attempt without effect is no macrostep. Then it repeats: take the oldest deferred event that no
  active state defers any more, else the oldest event of the external queue. When both are empty,
  fire the first expired timer. All events posted before the call are processed. Between two
  timers, `run` takes at most ``capacities.microsteps`` events that the machine sent to itself. The
  others wait for the next call, so that every call ends.
* *Time.* An event has the time at which it entered the queue: ``now`` for a posted event, the
  timer's deadline for an event sent during a timer's macrostep or by a delayed send.
* *Timers.* Entering a state arms its timers before its ``onentry`` content, in document order of
  its transitions. ``every`` is armed again, from its deadline, before its guard is evaluated. If
  several timeouts expire at one instant and one of them leaves the state of another, the other is
  dropped.
* *Guards.* A selection evaluates each guard at most once. A guard that fails to evaluate is false
  and raises ``error.execution``.
* *Deferral.* An active state defers an event unless it, or an active state below it, has an
  enabled transition for it. Then no region takes the event. It is kept if it came from the
  external queue. It is unhandled if it cannot wait: it was dispatched, it is internal, or
  operations called by guards filled the queue. The search from an atomic state outward ends at a
  deferring state, unless a region below that state has a transition for the event. Queued and
  deferred events together count against ``capacities.queue``.
* *Entry.* Only states below a transition's domain are entered, because only there states were
  exited (SCXML 3.11: exactly one child of a compound state is active). Appendix D calls
  addAncestorStatesToEnter with the parent of a history; that would also enter regions above the
  domain of a transition from within, where nothing was exited.
* *Histories.* Entering the parent of a history clears the recorded value, unless a transition from
  within the parent targets the history. No transition can read it before the parent is exited,
  which records a new value.
* *Order.* The content of a microstep's transitions runs in the order in which the active atomic
  states, in document order, selected them (executeTransitionContent).
* *Delayed sends* are timers, even with a delay of 0. When they expire, the event goes to the end
  of its queue.
* *Faults* are ``internal`` (the internal queue is full), ``microsteps`` (too many rounds),
  ``range``, and the name of an unhandled platform error, unless the chart is lenient. Only the
  first fault is reported, where it occurs. The failing expression ends its block, the microstep is
  completed, and the machine stops in its current configuration.
* *Rounds.* The first entry, or the reaction to the event or timeout, is the first round. Each
  further set of eventless transitions, and each internal event, is another. The fault occurs when
  a macrostep needs more than ``capacities.microsteps`` rounds.
* *End.* When a top-level final state is entered, the microstep is completed, the internal queue is
  dropped, and the states are exited, innermost first (exitInterpreter). The configuration still
  shows the final state. Queues and timers are emptied.
* *Invocations.* The macrostep that enters a state starts its invocations at its end, in document
  order: data are passed, and the first macrostep runs. Then each invoked machine takes one
  external event in turn, in document order, until all are quiet. This repeats at most
  ``capacities.microsteps`` times; the rest waits for the next call. All of it belongs to the
  macrostep of the invoker and has its time. Timers of invoked machines fire like timers of the
  invoker, after those with the same deadline there. Events for the invoker enter its external
  queue immediately, ``done.invoke`` last; if the queue is full, the sender gets the error. An
  event for a machine that does not run is ``error.communication``. Exiting the state cancels the
  invocation after the state's exit content: the invoked machine exits its states, and the events
  it sends are dropped. A fault of an invoked machine is a fault of its invoker.
* *Rejection.* ``post`` returns False when the queue is full or the machine is not running.
"""

from fsmkit.runtime.interpreter.macrostep import cancel, initial, start, step
from fsmkit.runtime.interpreter.run import (
    at_time,
    dispatch,
    next_deadline,
    post,
    run,
    step_event,
)
from fsmkit.runtime.interpreter.snapshot import (
    Delayed,
    Macrostep,
    Occurrence,
    Snapshot,
    Timeout,
    Timer,
)

__all__ = [
    "Delayed",
    "Macrostep",
    "Occurrence",
    "Snapshot",
    "Timeout",
    "Timer",
    "at_time",
    "cancel",
    "dispatch",
    "initial",
    "next_deadline",
    "post",
    "run",
    "start",
    "step",
    "step_event",
]
