"""Names that the C of a chart cannot use."""

from __future__ import annotations

import re

from fsmkit.emit import legal
from fsmkit.emit.c import WORDS


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


KEYWORDS = WORDS | {"m", "linux", "unix"}
"""Keywords of C and C++, since both include the header; ``m`` is always the machine."""

LOCALS = KEYWORDS | _words(
    "e i copy result NULL int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t"
)
"""Names that a parameter cannot have: those that the functions with parameters declare."""

MACROS = re.compile(
    r"FSM_.*|U?INT(_LEAST|_FAST)?\d+_(MAX|MIN|C)|(U?INT(MAX|PTR)|PTRDIFF|SIZE|SIG_ATOMIC|WCHAR|WINT)"
    r"_(MAX|MIN|C)|PRI\w+|SCN\w+|(FLT|DBL|LDBL|CHAR|SCHAR|UCHAR|SHRT|USHRT|INT|UINT|LONG|ULONG)_\w+"
    r"|NULL|EOF|BUFSIZ|INFINITY|NAN|HUGE_VAL|EXIT_\w+|RAND_MAX|CLOCKS_PER_SEC|SIG[A-Z]+|E[A-Z]{2,}"
    r"|assert|errno|std(in|out|err)|offsetof|setjmp|signbit|is(nan|inf|finite|normal)|fpclassify"
    r"|fsm_\w+|u?int\d+_t|size_t|va_(start|arg|end|copy)|static_assert|thread_local|noreturn|i386|mips|sparc|sun|vax"
)
"""Macros of the standard headers (C99 7.1.3, annex B), of compilers, and of the library; types."""

UNDERSCORED = re.compile(r"_[A-Z_].*")
"""Identifiers that C reserves in every scope (C99 7.1.3): ``_Bool``, ``__LINE__``."""

HEADERS = _words(
    "assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal "
    "stdalign stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath "
    "threads time uchar wchar wctype fsm fsm_bytes main"
)
"""Names that a machine cannot have, since its header would hide another, or `main`."""

INSIDE = _words(
    "acted acting allowance answer at before below bytes cause coming count counter deadline "
    "defers delay domain domains due entered error event failed fault first fits found given hi "
    "holds initial is_deferred is_external is_quiet is_sound item j keep kept key last leaves "
    "left length limit lo mark may_defer name none now number numbers other outside place "
    "preempted n peer queue r rank recalled region_of rest room round route running s said sent "
    "size state states symbol taken tell texts timer timers t to transition until value w was what "
    "whole why wins word words"
)
"""Names that a machine cannot have, since its functions use them and would hide its type."""

COUNTED = re.compile(r"(copy|holds|item|way|[dinostvw])_?\d+|was_\d+_\d+|(let|of_\d+)_\w+")
"""Numbered local variables and parameters, which likewise would hide its type."""

GROUPS = _words("in out data fsm spare_")
"""Members of the struct beside the machines in its slots."""

MEMBERS = _words(
    "to_invoke_ now timers queue deferred internal delayed event fault failed budget timer_count "
    "queue_count deferred_count internal_count delayed_count running finished busy "
    "reply asked unhandled rejected spare_"
)
"""Members of the machine's own group; its other members are named after states."""

FUNCTIONS = _words(
    "init start post run dispatch next_deadline in finished fault active rebase state event symbol "
    "state_name event_name event_text delayed step_event step_timer step_eventless stop "
    "take_out has_room enqueue raise error end_block send holds guard_holds clamp clamp_u clamp_f "
    "arm delay undelay cancel add selection conflict "
    "remove_conflicts microstep take take_eventless react settle begin macrostep unhandled leave "
    "act enter record domain domain_of answer_function answer_table not_running respond "
    "respond_any may_go_on rest emit take_one place_above region_of place_last path_places "
    "path_of path_step enter_path enter_place enter_recorded entry_of exit_of leave_until "
    "raise_plain disarm last_in_region "
    "guard_of select_at row_table row_event row_guard row_first region_at grid enters "
    "is_deferred is_allowed select_event select_eventless event_symbol no_event last_below "
    "source_of is_answered is_kept copy_of copy_taking copy_asking "
    "save restore info driver "
    "sample apply cycle bind"
)
"""The names after the prefix in functions and types of every machine."""

FAMILIES = re.compile(
    r"leave_\d+_above|(leave|state|always|guard|ask|block|part|select_event|select_eventless)_\d+"
    r"|(block|guard)_\d+_of|(data|in|out)_at_\d+|(call|post|send)_.*"
)
"""Numbered and derived names of functions."""

FIXED_MACROS = re.compile(
    "H|QUEUE|INTERNAL|MICROSTEPS|TICK_US|TIMERS|STRUCT_BYTES|SAVED_BYTES|DELAYED|STATES|EVENTS"
    "|NO_EVENT|DEFER|REGIONS"
)
"""The names after the prefix in the macros of machines."""

TAKEN_MACROS = re.compile(rf"{FIXED_MACROS.pattern}|(SLOT|STATE|EVENT|TIMER|TO)_.*")
"""The same, and constants with derived names."""

TO_INVOKE = "to_invoke_"
"""The member with a bit for each state that invokes something."""

INVOKING = _words(
    "start_given abandon return to_invoker invoke run_invoked go_on external complete tell_end "
    "step_timer_within"
)
"""The names after the prefix in machines that invoke others or are invoked."""

NUMBERED = re.compile(r"(absorb|give|end|holder_of|to_invoked)_\d+")
"""The numbered ones of these names."""


def unreserved(name: str) -> str:
    """Return a name that is valid alone in C: no macro and no reserved identifier."""
    found = legal(name)
    if UNDERSCORED.fullmatch(found):
        return f"v{found}"
    return f"{found}_" if MACROS.fullmatch(found) else found
