/* harness.h: a machine under a script: its hooks, and what plays the script; see harness.c.
 *
 * The source of a machine X is included with HOOKED defined as X, after WATCH(X, path). */
#ifndef HARNESS_H
#define HARNESS_H

#include "fsm_info.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* A machine, with what its lines begin with: the slots in which it lies. */
typedef struct {
    const fsm_machine_info *info;
    const char *path;
    uint32_t now; /* of a machine that does not keep its time */
} watched;

/* Play a script on a machine, with room for an event, for one that an operation posts, and for the
 * machine as bytes. */
void play_script(watched *of, const fsm_driver *driver, void *m, void *e, void *posted,
                 uint8_t *saved, size_t size);

void wrong(const char *what);

static void begun(const watched *of);
static void hook_begin(const watched *of, const void *m, int cause, unsigned index);
static bool hook_end(const watched *of);
static void hook_event(const watched *of, int what, const void *e);
static void hook_text(const watched *of, int what, const char *text, unsigned long number);
static void hook_symbol(const watched *of, long symbol);
static void show_integer(bool negative, uint64_t value);
static void show_float(double value);
static void fsm_host_call(const watched *of, uint32_t number, const void *const *given, void *result);

#define HOOKED_JOIN(X, name) X##name
#define HOOKED_NAME(X, name) HOOKED_JOIN(X, name)
#define HOOKED_IT (&HOOKED_NAME(fsm_watched_, HOOKED))

#define FSM_HOOK_BEGIN(m, cause, index) hook_begin(HOOKED_IT, m, cause, index)
#define FSM_HOOK_END(m) HOOKED_NAME(shown_, HOOKED)(m)
#define FSM_HOOK_EXIT(m, state) \
    ((void)(m), begun(HOOKED_IT), printf("- %s\n", HOOKED_NAME(HOOKED, _state_name)(state)))
#define FSM_HOOK_TAKE(m, transition) \
    ((void)(m), begun(HOOKED_IT), printf("t %u\n", (unsigned)(transition)))
#define FSM_HOOK_ENTER(m, state) \
    ((void)(m), begun(HOOKED_IT), printf("+ %s\n", HOOKED_NAME(HOOKED, _state_name)(state)))
#define FSM_HOOK_EVENT(m, what, e) ((void)(m), hook_event(HOOKED_IT, what, e))
#define FSM_HOOK_LEFT FSM_NOTE_LEFT
#define FSM_HOOK_TEXT(m, what, text, number) ((void)(m), hook_text(HOOKED_IT, what, text, number))
#define FSM_HOOK_VALUE_I(m, value) ((void)(m), show_integer((value) < 0, (uint64_t)(value)))
#define FSM_HOOK_VALUE_F(m, value) ((void)(m), show_float((double)(value)))
#define FSM_HOOK_VALUE_S(m, value) ((void)(m), hook_symbol(HOOKED_IT, value))
#define FSM_HOOK_LINE(m) ((void)(m), printf("\n"))
#define FSM_HOST_CALL(m, operation, given, result) \
    ((void)(m), fsm_host_call(HOOKED_IT, operation, given, result))
#define FSM_HOST_SEND(m, event, given) ((void)(m), (void)(given))

/* What is known of a machine X, and what shows its active states; 65,535 leaves at most. */
#define WATCH(X, path) \
    extern const fsm_machine_info X##_info; \
    static watched fsm_watched_##X = {&X##_info, path, 0}; \
    static void shown_##X(const X *m) \
    { \
        if (!hook_end(&fsm_watched_##X)) \
            return; \
        static X##_state states[leaves_##X]; \
        const uint16_t count = X##_active(m, states, leaves_##X); \
        for (uint16_t i = 0; i < count; i++) \
            printf(" %s", X##_state_name(states[i])); \
        printf("%s\n", X##_finished(m) ? " finished" : ""); \
    }

#endif
