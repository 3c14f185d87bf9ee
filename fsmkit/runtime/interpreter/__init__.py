"""The reference interpreter: Appendix D of SCXML 1.0 by name, a pure function of a snapshot.

Where the standard or SEMANTICS leaves a choice, these hold on every runtime:

* *Run.* First, if some eventless guard reads an input, eventless transitions are tried once (no
  macrostep is reported where nothing happened). Then, again and again: the oldest deferred event
  that no active state defers any more, else the oldest event of the external queue; when both are
  empty, the first timer that is due. Events posted before the call count as many as they are; of
  those that the machine sends itself, at most ``capacities.microsteps`` are taken between two
  timers, the others wait for the next call, so that a call always ends.
* *Time.* An event taken from the queue has the time of what put it there: ``now`` for posted ones,
  the deadline of the timer whose macrostep (or which itself, as a delayed send) put it there.
* *Timers* of a state are armed when it is entered, before its ``onentry`` content, in document
  order of its transitions. ``every`` arms itself again, from its deadline, before its guard is
  looked at. A timeout of several due at one instant is dropped if its state is left by another.
* *Guards* are evaluated at most once in one selection. One that fails to evaluate is false, and
  raises ``error.execution``.
* *Deferral.* An event is deferred if an active state defers it and neither that state nor an
  active one below it has an enabled transition for it. Then no region takes it: it is kept if it
  came from the external queue. One that cannot wait is unhandled: it was dispatched, is internal,
  or operations that guards called have posted other events into its place. Looking for a transition
  from an atomic state outward ends at a state that defers the event, unless a region below that
  state has a transition for it. Deferred events count as events of the external queue: both
  together hold at most ``capacities.queue``.
* *Entry.* Nothing is entered that does not lie below a transition's domain, where everything was
  left (SCXML 3.11: of a compound state one child is active). Appendix D's addAncestorStatesToEnter,
  called for what a history stands for with the parent of the history, adds all that lies between
  with all regions, also above the domain of a transition from within, where nothing was left.
* *Histories* are forgotten when their parent is entered, if no transition from within it leads to
  them: while it is active nothing can ask for them then, and leaving it records them anew.
* *Order.* Content of the transitions of one microstep runs in the order in which the active atomic
  states, in document order, selected them (Appendix D, executeTransitionContent).
* *Delayed sends*, also with a delay of 0, are timers; when due they go to the end of their queue.
* *Faults* (``internal``: the internal queue is full; ``microsteps``: the rounds of a macrostep are
  used up; ``range``; the name of a platform error that is unhandled, unless the chart is lenient)
  are reported where they occur, the first only. An expression that faults ends its block; the
  microstep is completed; then the machine stops. Its configuration stays.
* *Rounds.* The first entry, or the reaction to the event or timeout (even to no effect), is
  the first of at most ``capacities.microsteps`` rounds; each further set of eventless transitions
  taken, and each internal event, is another. The fault comes when one more would be needed.
* *End.* When a top-level final state is entered, the microstep is completed, what is left in the
  internal queue is dropped, and the states are left, innermost first (exitInterpreter). The
  configuration still tells where it ended. Queues and timers are emptied.
* *Invocations.* What a state invokes is started at the end of the macrostep that entered it, in
  document order: data are given, the first macrostep is run. When every one runs, they take one
  external event each, in document order, until all are quiet (at most ``capacities.microsteps``
  times; the rest waits for the next call): all that belongs to the macrostep of the invoker, and
  has its time. A timer of an invoked machine is due as if it were the invoker's, after those due at
  once there. Events for the invoker go to its external queue at once, ``done.invoke`` last; one
  that is full tells so where the event was sent. An event for a machine that does not run is
  ``error.communication``. Leaving the state cancels, after its own exit content: the invoked
  machine leaves its states, and what it sends then goes nowhere. Its fault is one of the invoker.
* *Refusal.* ``post`` is refused when the queue is full and when the machine is not running.
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
