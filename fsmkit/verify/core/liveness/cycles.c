#include "liveness/cycles.h"

#include "search/scc.h"

#include <stdlib.h>

/* --- livelock: a grey state met again ------------------------------------------------------- */

static bool read_cycle(const fsm_scc *self, uint64_t start, fsm_cycle *found)
{
    size_t first = self->frame_count;
    while (self->frames[first - 1].state != start)
        first--;
    first--;
    found->state = fsm_set_at(&self->search->passed, start);
    found->length = (uint32_t)(self->frame_count - first);
    found->steps = malloc(found->length * sizeof *found->steps);
    if (found->steps == NULL)
        return false;
    for (size_t i = first; i < self->frame_count; i++)
        found->steps[i - first] = self->edges[self->frames[i].edge - 1].step;
    return true;
}

static bool walk_from(fsm_scc *self, uint64_t root, unsigned char *colour, fsm_cycle *found)
{
    enum { WHITE, GREY, BLACK };
    if (!fsm_scc_enter(self, root))
        return false;
    colour[root] = GREY;
    while (self->frame_count > 0) {
        fsm_frame *at = fsm_scc_top(self);
        if (at->edge == at->end) {
            colour[at->state] = BLACK;
            fsm_scc_leave(self);
            continue;
        }
        uint64_t to = self->edges[at->edge++].to;
        if (colour[to] == GREY)
            return read_cycle(self, to, found);
        if (colour[to] == WHITE) {
            if (!fsm_scc_enter(self, to))
                return false;
            colour[to] = GREY;
        }
    }
    return true;
}

bool fsm_find_livelock(fsm_search *search, fsm_cycle *found)
{
    *found = (fsm_cycle){.state = FSM_NO_STATE};
    if (!search->maybe_cyclic)
        return true; /* each cycle holds a step to a state that is known */
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    fsm_scc self;
    unsigned char *colour = calloc(places, 1);
    bool fine = fsm_scc_init(&self, search) && colour != NULL;
    self.internal_only = true;
    for (uint64_t root = 0; fine && found->state == FSM_NO_STATE && root < places; root++)
        if (fsm_set_taken(passed, root) && colour[root] == 0)
            fine = walk_from(&self, root, colour, found);
    free(colour);
    fsm_scc_free(&self);
    return fine;
}

/* --- traps: bottom components ------------------------------------------------------------------- */

typedef struct {
    const fsm_search *search;
    fsm_report_trap *report;
    void *context;
} traps;

static unsigned char close_trap(void *context, const fsm_components *all, const uint64_t *places, size_t count,
                                unsigned char leaves)
{
    enum { MOST = 256 };
    const traps *self = context;
    const fsm_model *model = self->search->model;
    fsm_state states[MOST];
    uint32_t shown = 0;
    bool uniform = leaves == 0;
    (void)all;
    for (size_t i = 0; uniform && i < count; i++) {
        fsm_state state = fsm_set_at(&self->search->passed, places[i]);
        uint32_t configuration = model->configuration(model->self, state);
        shown = i == 0 ? configuration : shown;
        uniform = configuration == shown && !model->at_rest(model->self, state);
        if (i < MOST)
            states[i] = state;
    }
    if (uniform)
        self->report(self->context, states, count < MOST ? count : MOST);
    return 0;
}

bool fsm_find_traps(fsm_search *search, fsm_report_trap *report, void *context)
{
    const fsm_set *passed = &search->passed;
    traps all = {search, report, context};
    fsm_components components = {.close = close_trap, .context = &all};
    fsm_scc walk;
    bool fine = fsm_scc_init(&walk, search);
    fine = fsm_components_init(&components, search) && fine;
    for (uint64_t root = 0; fine && root < fsm_set_places(passed); root++)
        if (fsm_set_taken(passed, root))
            fine = fsm_components_from(&components, &walk, root);
    fsm_components_free(&components);
    fsm_scc_free(&walk);
    return fine;
}
