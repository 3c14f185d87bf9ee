#define _POSIX_C_SOURCE 200809L
#include "report.h"

#include "system/saved_locals.h"
#include "system/spread.h"
#include "system/system_model.h"

#include <inttypes.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

#ifndef FSM_PROGRESS_EVERY
#define FSM_PROGRESS_EVERY 1.0 /* seconds; a test lets it be none */
#endif

#define FSM_PATHS_AFTER_INTERRUPT 0.5 /* seconds */

const char *fsm_outcome_name(fsm_outcome outcome)
{
    switch (outcome) {
    case FSM_COMPLETE:
        return "complete";
    case FSM_DECIDED:
        return "decided";
    case FSM_OUT_OF_MEMORY:
        return "memory";
    case FSM_OUT_OF_TIME:
        return "time";
    case FSM_INTERRUPTED:
        return "interrupted";
    case FSM_MODEL_FAILED:
        break;
    }
    return "failed";
}

const char *fsm_action_name(fsm_action action)
{
    static const char *const names[] = {"start", "take", "fire", "eventless", "occur", "elapse"};
    return names[action];
}

static void print_seen(const char *name, const unsigned char *seen, uint32_t count)
{
    printf(", \"%s\": \"", name);
    for (uint32_t i = 0; i < count; i++)
        printf("%c", seen[i] ? '1' : '0');
    printf("\"");
}

void fsm_print_machines(const fsm_composition *composition, fsm_outcome outcome)
{
    const fsm_system *system = &fsm_the_system;
    printf(", \"machines\": [");
    for (uint32_t i = 0; i < system->machine_count; i++) {
        fsm_bounds bounds = fsm_composition_bounds(composition, i);
        printf("%s{\"locals\": %" PRIu32 ", \"queue\": %" PRIu32 ", \"timers\": %" PRIu32
               ", \"microsteps\": %" PRIu32,
               i == 0 ? "" : ", ", fsm_local_count(composition, i), bounds.queue, bounds.timers,
               bounds.microsteps);
        print_seen("states", fsm_states_seen(composition, i), system->machines[i]->info->state_count);
        print_seen("transitions", fsm_transitions_seen(composition, i),
                   system->machines[i]->info->transition_count);
        if (outcome != FSM_COMPLETE && outcome != FSM_DECIDED)
            fsm_print_spread(composition, i);
        fsm_print_saved_locals(composition, i);
        printf("}");
    }
    printf("]");
}

double fsm_seconds(void)
{
    struct timespec at;
    (void)clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + (double)at.tv_nsec / 1e9;
}

void fsm_pace_start(fsm_pace *self)
{
    self->started = self->last_shown = fsm_seconds();
    self->parent = getppid();
}

fsm_outcome fsm_pace_check(fsm_pace *self, fsm_progress progress)
{
    double now = fsm_seconds();
    if (self->progress && now - self->last_shown >= FSM_PROGRESS_EVERY) {
        self->last_shown = now;
        (void)fprintf(stderr, "{\"progress\": {\"states\": %" PRIu64 ", \"transitions\": %" PRIu64 ", \"depth\": %" PRIu32
                      ", \"bytes\": %zu}}\n",
                      progress.states, progress.transitions, progress.depth, progress.bytes);
    }
    if (self->interrupted() || getppid() != self->parent)
        return FSM_INTERRUPTED;
    return self->timeout > 0 && now - self->started >= self->timeout ? FSM_OUT_OF_TIME : FSM_COMPLETE;
}

bool fsm_keep_pace(fsm_search *search)
{
    fsm_pace *pace = search->context;
    const fsm_progress progress = {pace->counted != NULL ? *pace->counted : search->passed.count, search->transitions,
                                   search->depth, fsm_search_bytes(search)};
    fsm_outcome why = fsm_pace_check(pace, progress);
    if (why != FSM_COMPLETE)
        search->outcome = why;
    return search->outcome == FSM_COMPLETE;
}

bool fsm_seek_on(const fsm_search *search)
{
    fsm_pace *pace = search->context;
    if (pace->interrupted() || getppid() != pace->parent) {
        pace->noticed = pace->noticed > 0 ? pace->noticed : fsm_seconds();
        return fsm_seconds() - pace->noticed < FSM_PATHS_AFTER_INTERRUPT;
    }
    return pace->paths <= 0 || fsm_seconds() - pace->started < pace->paths;
}
