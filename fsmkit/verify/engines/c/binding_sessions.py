"""The C between an invoked machine and the explorer: what the binding of its invoker asks of it.

The source of an invoked machine is compiled within the file written here, under hooks of its own:
its states and transitions are not those of the machine that is explored.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.codegen.c.generate import Machine
from fsmkit.texts import printing
from fsmkit.texts.c import quoted
from fsmkit.verify.engines.c.binding import MachineBinding
from fsmkit.verify.engines.c.binding_values import Built, members_by_prefix
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.dead_variables import ResettableVariable

HOOKS = r"""
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_EXIT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_ENTER
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_TEXT
#define FSM_HOOK_BEGIN(m, cause, index) ((void)0)
#define FSM_HOOK_EXIT(m, state) fsm_note_line($PATH "-", (uint32_t)(state))
#define FSM_HOOK_TAKE(m, transition) fsm_note_line($PATH "t", (uint32_t)(transition))
#define FSM_HOOK_ENTER(m, state) fsm_note_line($PATH "+", (uint32_t)(state))
#define FSM_HOOK_EVENT(m, what, e) ((void)0)
#define FSM_HOOK_TEXT(m, what, text, number) \
    ((what) == FSM_FULL ? fsm_note_text(FSM_NOTE_FULL, $PATH "full", text) \
     : (what) == FSM_FAULT ? fsm_note_text(FSM_NOTE_FAULT, $PATH "fault", text) : (void)0)
"""


def sessions_of(built: Built, members: Mapping[str, frozenset[str]]) -> Iterator[Built]:
    """Yield the machines in the slots of one, and in theirs; ``members`` of structs by prefix."""
    for names in built.names.invoked:
        inner = Built(built.number, names.chart, names, members[names.prefix])
        yield inner
        yield from sessions_of(inner, members)


def session_files(closed: ClosedSystem, built: Built, generated: Machine) -> dict[str, str]:
    """Return the files of a machine with those of the machines in its slots to be compiled."""
    found = dict(generated.files)
    found[f"{built.prefix}_info.inc"] = found.pop(f"{built.prefix}_info.c")
    for session in sessions_of(built, members_by_prefix(generated)):
        found[f"{session.prefix}.inc"] = found.pop(f"{session.prefix}.c")
        found[f"explore_{session.prefix}.c"] = SessionBinding(closed, session).text()
    return found


class SessionBinding(MachineBinding):
    """Writes the file of a machine in a slot."""

    def __init__(self, closed: ClosedSystem, built: Built) -> None:
        """Write for a machine in a slot of one of a closed system."""
        super().__init__(closed, built)
        self.path = "".join(slot + ": " for slot in built.names.path)

    @printing
    def text(self) -> str:
        """Return the file."""
        self.out.line(f"/* What the explorer does with `{self.type}`, an invoked machine. */")
        includes = (f"{self.type}.h", "system/session.h", "system/binding.h")
        self.out.lines(f'#include "{name}"' for name in includes)
        self.out.lines([f"extern const fsm_machine_info {self.type}_info;", ""])
        self.out.lines(HOOKS.replace("$PATH", quoted(self.path)).split("\n"))
        self.out.lines([f'#include "{self.type}.inc"', ""])
        self._declare_sessions()
        self._regions()
        self._host()
        self._recalled()
        self._silence()
        self._timer_name()
        if self.closed.untimed:
            self._choose_timer("UINT32_MAX")
        self._settle()
        self._view()
        self._dump()
        self._exported()
        return self.out.finish()

    @property
    def _mortal(self) -> tuple[ResettableVariable, ...]:
        """None: the data of an invoked machine are not analysed."""
        return ()

    def _is_linked(self, port: int) -> bool:
        """No wire begins at an invoked machine."""
        del port
        return False

    @property
    def _first_port(self) -> int:
        return len(self.chart.events)

    def _exported(self) -> None:
        untimed = self.closed.untimed
        with self.out.block(f"const fsm_session fsm_session_{self.type} = {{", "};"):
            for name in ("settle", "view", "configuration", "dump"):
                self.out.line(f".{name} = {name},")
            for name, text in (("choose", "choose"), ("timer_name", "timer_name")):
                self.out.line(f".{name} = {text if untimed else 'NULL'},")
