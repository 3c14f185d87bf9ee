#include "liveness/counterexample.h"

#include <stdlib.h>

void fsm_lasso_free(fsm_lasso *self)
{
    free(self->path.steps);
    free(self->cycle.steps);
    *self = (fsm_lasso){0};
}

bool fsm_is_marked(const fsm_model *model, fsm_state state, uint32_t mark)
{
    uint32_t set = model->marks(model->self, state), count = 0;
    const uint32_t *marks = set == 0 || set == FSM_NONE ? NULL : model->mark_set(model->self, set, &count);
    for (uint32_t i = 0; i < count; i++)
        if (marks[i] == mark)
            return true;
    return false;
}

/* --- the nearest state of some kind ----------------------------------------------------------------- */

typedef struct {
    const fsm_set *passed;
    const unsigned char *flags;
    unsigned char requested;
} flagged;

static bool is_flagged(void *context, fsm_state state)
{
    const flagged *self = context;
    uint64_t place = fsm_set_find(self->passed, state);
    return place != FSM_NOWHERE && (self->flags[place] & self->requested) != 0;
}

fsm_state fsm_path_to_flagged(fsm_search *search, const unsigned char *flags, unsigned char requested, fsm_path *path)
{
    flagged context = {&search->passed, flags, requested};
    fsm_found found = {.state = FSM_NO_STATE};
    fsm_search again;
    if (search->trace != NULL)
        return search->trace(search, flags, requested, path);
    if (!fsm_search_init(&again, search->model, search->memory_limit))
        return FSM_NO_STATE;
    again.cores = search->cores;
    again.large = search->large;
    again.chunk = search->chunk;
    again.sleepless = search->sleepless;
    again.is_target = is_flagged;
    again.target_context = &context;
    again.groups = &found;
    again.group_count = again.groups_left = 1;
    fsm_search_run(&again);
    if (found.state != FSM_NO_STATE && !fsm_path_to(&again, &found, path)) {
        found.state = FSM_NO_STATE;
        path->count = 0;
    }
    again.groups = NULL;
    again.group_count = 0;
    fsm_search_free(&again);
    return found.state;
}
