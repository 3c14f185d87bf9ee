#include "report.h"

#include <inttypes.h>
#include <stdio.h>

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

void fsm_print_machines(const fsm_composition *composition)
{
    const fsm_system *system = &fsm_the_system;
    printf(", \"machines\": [");
    for (uint32_t i = 0; i < system->machine_count; i++) {
        fsm_bounds bounds = fsm_composition_bounds(composition, i);
        printf("%s{\"locals\": %" PRIu32 ", \"queue\": %" PRIu32 ", \"timers\": %" PRIu32
               ", \"microsteps\": %" PRIu32,
               i == 0 ? "" : ", ", fsm_local_count(composition, i), bounds.queue, bounds.timers,
               bounds.microsteps);
        print_seen("states", fsm_states_seen(composition, i), system->machines[i]->state_count);
        print_seen("transitions", fsm_transitions_seen(composition, i),
                   system->machines[i]->transition_count);
        printf("}");
    }
    printf("]");
}

fsm_outcome fsm_pace_ask(fsm_pace *self, fsm_progress progress)
{
    time_t now = time(NULL);
    if (self->progress && now != self->last_shown) {
        self->last_shown = now;
        printf("{\"progress\": {\"states\": %" PRIu64 ", \"expanded\": %" PRIu64 ", \"transitions\": %" PRIu64
               ", \"depth\": %" PRIu32 ", \"bytes\": %zu}}\n",
               progress.states, progress.expanded, progress.transitions, progress.depth, progress.bytes);
        (void)fflush(stdout);
    }
    if (self->interrupted())
        return FSM_INTERRUPTED;
    return self->timeout > 0 && difftime(now, self->started) >= self->timeout ? FSM_OUT_OF_TIME : FSM_COMPLETE;
}

bool fsm_keep_pace(fsm_search *search)
{
    const fsm_progress progress = {search->passed.count, search->expanded, search->transitions, search->depth,
                                   fsm_search_bytes(search)};
    fsm_outcome why = fsm_pace_ask(search->context, progress);
    if (why != FSM_COMPLETE)
        search->outcome = why;
    return search->outcome == FSM_COMPLETE;
}
