/* fsm_python_hooks.h: what stands before the source of each machine of an extension module, before the
 * headers of Python, whose macros would take names of a chart apart.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   FSM_PY_THIS     the table of the machine, a static fsm_py_machine
 *   FSM_PY_TRACED   defined: it has a trace
 *   FSM_PY_KEEPS    defined: after each macrostep its object keeps a copy of it
 *
 * and, for all of the file, FSM_PY_RECORDED: machines are recorded (fsm_recorded.h, included after
 * this), each into bytes of its own. */
#ifndef FSM_PYTHON_HOOKS_H
#define FSM_PYTHON_HOOKS_H

#include "fsm_info.h"

static bool fsm_py_is_foreign; /* whether a string was saved that the chart does not know */
#define FSM_HOOK_FOREIGN(symbol) (fsm_py_is_foreign = true)

#ifdef FSM_PY_RECORDED
#define FSM_TRACE_LEVEL 2
#define FSM_TRACE_STATE fsm_py_records /* of the current machine */
#define FSM_TRACE_PUT(bytes, n) fsm_py_put_record(bytes, n)
static bool fsm_py_put_record(const uint8_t *bytes, unsigned n);
#include "fsm_records.h"
#include "fsm_records.c"
#define FSM_RECORDED_AND
#define FSM_RECORDED_AND_BEGIN FSM_PY_BEGIN
#define FSM_RECORDED_AND_EVENT FSM_PY_EVENT_IS
#define FSM_RECORDED_AND_TAKE FSM_PY_TAKE
#define FSM_RECORDED_AND_TEXT FSM_PY_TEXT
#define FSM_RECORDED_AND_LEFT FSM_NOTE_LEFT
#endif

#ifdef __GNUC__
#define FSM_PY_MAYBE __attribute__((unused)) static
#else
#define FSM_PY_MAYBE static
#endif

/* A call of the host: the number of its method, the name of the result in messages, whether it
 * takes the peer. Number -1: it is never called. */
typedef struct {
    int number;
    const char *said;
    bool has_peer;
} fsm_py_call;

/* A machine: that of the class, or one in a slot of another. */
typedef struct {
    const fsm_machine_info *info;
    uint32_t offset;   /* in the machine of the class */
    const char *path;  /* the start of its lines: the slots that contain it */
    const fsm_py_call *operations, *sent; /* by number */
    int first, after;  /* the range of its methods among those of the host */
} fsm_py_machine;

FSM_PY_MAYBE void fsm_py_on_begin(const fsm_py_machine *of, void *m, int cause, unsigned index);
FSM_PY_MAYBE void fsm_py_on_end(const fsm_py_machine *of, void *m);
FSM_PY_MAYBE void fsm_py_on_event(const fsm_py_machine *of, void *m, int what, const void *e);
FSM_PY_MAYBE void fsm_py_on_state(const fsm_py_machine *of, void *m, const char *verb, uint32_t state);
FSM_PY_MAYBE void fsm_py_on_take(const fsm_py_machine *of, void *m, unsigned transition);
FSM_PY_MAYBE void fsm_py_on_text(const fsm_py_machine *of, void *m, int what, const char *text,
                                 unsigned long number);
FSM_PY_MAYBE void fsm_py_on_integer(const fsm_py_machine *of, void *m, char kind, uint64_t value);
FSM_PY_MAYBE void fsm_py_on_float(const fsm_py_machine *of, void *m, double value);
FSM_PY_MAYBE void fsm_py_on_string(const fsm_py_machine *of, void *m, long value);
FSM_PY_MAYBE void fsm_py_on_line(const fsm_py_machine *of, void *m);
FSM_PY_MAYBE void fsm_py_keep(const fsm_py_machine *of, void *m);
FSM_PY_MAYBE void fsm_py_operate(const fsm_py_machine *of, void *m, uint32_t number,
                                 const void *const *given, void *result);
FSM_PY_MAYBE void fsm_py_emit(const fsm_py_machine *of, void *m, uint32_t number,
                              const void *const *given);

#define FSM_HOST_CALL(m, operation, given, result) fsm_py_operate(&FSM_PY_THIS, m, operation, given, result)
#define FSM_HOST_SEND(m, event, given) fsm_py_emit(&FSM_PY_THIS, m, event, given)

#endif

#undef FSM_PY_BEGIN
#undef FSM_PY_EVENT_IS
#undef FSM_PY_TAKE
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_END
#undef FSM_HOOK_EXIT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_ENTER
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_LEFT
#undef FSM_HOOK_POST
#undef FSM_HOOK_TEXT
#undef FSM_HOOK_VALUE_I
#undef FSM_HOOK_VALUE_F
#undef FSM_HOOK_VALUE_S
#undef FSM_HOOK_LINE
#undef FSM_HOOKS
#ifdef FSM_PY_TRACED
#define FSM_HOOKS "fsm.h"
#define FSM_PY_BEGIN(m, cause, index) fsm_py_on_begin(&FSM_PY_THIS, m, cause, index)
#define FSM_PY_EVENT_IS(m, what, e) fsm_py_on_event(&FSM_PY_THIS, m, what, e)
#define FSM_PY_TAKE(m, transition) fsm_py_on_take(&FSM_PY_THIS, m, (unsigned)(transition))
#define FSM_HOOK_END(m) fsm_py_on_end(&FSM_PY_THIS, m)
#define FSM_HOOK_EXIT(m, state) fsm_py_on_state(&FSM_PY_THIS, m, "- ", (uint32_t)(state))
#define FSM_HOOK_ENTER(m, state) fsm_py_on_state(&FSM_PY_THIS, m, "+ ", (uint32_t)(state))
#else
#ifdef FSM_PY_KEEPS
#define FSM_HOOK_END(m) fsm_py_keep(&FSM_PY_THIS, m)
#else
#define FSM_HOOK_END(m) ((void)(m))
#endif
#define FSM_PY_BEGIN(m, cause, index) ((void)(m))
#define FSM_PY_EVENT_IS(m, what, e) FSM_UNUSED_2(m, e)
#define FSM_PY_TAKE(m, transition) FSM_UNUSED_2(m, transition)
#define FSM_HOOK_EXIT(m, state) FSM_UNUSED_2(m, state)
#define FSM_HOOK_ENTER(m, state) FSM_UNUSED_2(m, state)
#endif
#define FSM_PY_TEXT(m, what, text, number) fsm_py_on_text(&FSM_PY_THIS, m, what, text, number)
#define FSM_HOOK_BEGIN FSM_PY_BEGIN
#define FSM_HOOK_EVENT FSM_PY_EVENT_IS
#define FSM_HOOK_TAKE FSM_PY_TAKE
#define FSM_HOOK_TEXT FSM_PY_TEXT
#define FSM_HOOK_LEFT FSM_NOTE_LEFT
#define FSM_HOOK_POST(m, e, fits) FSM_UNUSED_2(m, e)
#define FSM_HOOK_VALUE_I(m, value)                                                                 \
    fsm_py_on_integer(&FSM_PY_THIS, m, _Generic((value), bool: 'b', uint64_t: 'u', default: 'i'),  \
                      (uint64_t)(value))
#define FSM_HOOK_VALUE_F(m, value) fsm_py_on_float(&FSM_PY_THIS, m, (double)(value))
#define FSM_HOOK_VALUE_S(m, value) fsm_py_on_string(&FSM_PY_THIS, m, (long)(value))
#define FSM_HOOK_LINE(m) fsm_py_on_line(&FSM_PY_THIS, m)
