#include "liveness/liveness.h"

#include "liveness/fairness.h"
#include "search/scc.h"

#include <stdlib.h>

/* --- recoverable ------------------------------------------------------------------------------------- */

enum { GOOD = 2, BAD = 4 }; /* values of components */

typedef struct {
    const fsm_search *search;
    uint32_t mark;
    bool violated;
} recovery;

static unsigned char close_recovered(void *context, const fsm_components *all, const uint64_t *places, size_t count,
                                     unsigned char leaves)
{
    recovery *self = context;
    const fsm_search *search = self->search;
    bool good = (leaves & GOOD) != 0;
    (void)all;
    for (size_t i = 0; !good && i < count; i++)
        good = fsm_is_marked(search->model, fsm_set_at(&search->passed, places[i]), self->mark);
    self->violated = self->violated || !good;
    return good ? GOOD : BAD;
}

bool fsm_find_unrecoverable(fsm_search *search, uint32_t mark, fsm_lasso *found)
{
    recovery all = {search, mark, false};
    fsm_components components = {.close = close_recovered, .context = &all};
    fsm_scc walk;
    *found = (fsm_lasso){0};
    bool fine = fsm_scc_init(&walk, search);
    fine = fsm_components_init(&components, search) && fine;
    for (uint64_t root = 0; fine && root < fsm_set_places(&search->passed); root++)
        if (fsm_set_taken(&search->passed, root))
            fine = fsm_components_from(&components, &walk, root);
    found->violated = all.violated;
    if (fine && found->violated)
        (void)fsm_path_to_flagged(search, components.value, BAD, &found->path);
    fsm_components_free(&components);
    fsm_scc_free(&walk);
    return fine && search->model->failure(search->model->self) == NULL;
}

/* --- leads to ------------------------------------------------------------------------------------------ */

static void flag_states(fsm_fairness *self, uint32_t request, uint32_t answer)
{
    const fsm_search *search = self->search;
    for (uint64_t place = 0; place < fsm_set_places(&search->passed); place++) {
        if (!fsm_set_taken(&search->passed, place))
            continue;
        fsm_state state = fsm_set_at(&search->passed, place);
        if (fsm_is_marked(search->model, state, answer))
            self->flags[place] = FSM_ANSWERED;
        else if (fsm_is_marked(search->model, state, request))
            self->flags[place] = FSM_REQUESTED;
    }
}

/* A component of states without an answer is bad if a fair run can stay in it, or in one it leads to. */
static unsigned char close_unanswered(void *context, const fsm_components *all, const uint64_t *places, size_t count,
                                      unsigned char leaves)
{
    fsm_fairness *self = context;
    bool bad = (leaves & BAD) != 0;
    for (size_t i = 0; i < count; i++)
        bad = bad || (self->flags[places[i]] & FSM_ENDLESS) != 0;
    bad = fsm_fairness_evaluate(self, all, places, count) || bad;
    for (size_t i = 0; bad && i < count; i++)
        if ((self->flags[places[i]] & FSM_REQUESTED) != 0) {
            self->flags[places[i]] |= FSM_HOPELESS;
            self->violated = true;
        }
    return bad ? BAD : 0;
}

static unsigned char close_unstable(void *context, const fsm_components *all, const uint64_t *places, size_t count,
                                    unsigned char leaves)
{
    (void)leaves;
    (void)fsm_fairness_evaluate(context, all, places, count);
    return 0;
}

/* Visits the components of states without the flags `outside`, from states with one of `roots`. */
static bool go_through(fsm_fairness *self, fsm_components *components, unsigned char outside, unsigned char roots)
{
    fsm_scc walk;
    const fsm_set *passed = &self->search->passed;
    bool fine = fsm_scc_init(&walk, self->search);
    fine = fsm_components_init(components, self->search) && fine;
    walk.flags = self->flags;
    walk.outside = self->outside = outside;
    for (uint64_t root = 0; fine && root < fsm_set_places(passed); root++)
        if (fsm_set_taken(passed, root) && (self->flags[root] & outside) == 0
            && (roots == 0 || (self->flags[root] & roots) != 0))
            fine = fsm_components_from(components, &walk, root) && !self->failed;
    fsm_scc_free(&walk);
    return fine;
}

bool fsm_find_violations(fsm_search *search, uint32_t request, uint32_t answer, bool timeless, fsm_lasso *found)
{
    fsm_fairness self;
    fsm_components unstable = {.close = close_unstable, .context = &self};
    fsm_components stable = {.close = close_unanswered, .context = &self};
    *found = (fsm_lasso){0};
    bool fine = fsm_fairness_init(&self, search);
    if (fine)
        flag_states(&self, request, answer);
    if (fine && timeless) {
        fine = fsm_fairness_flag_stable(&self);
        self.unstable = true;
        fine = fine && go_through(&self, &unstable, FSM_ANSWERED | FSM_STABLE, 0);
    }
    self.unstable = false;
    fine = fine && go_through(&self, &stable, FSM_ANSWERED, FSM_REQUESTED);
    found->violated = self.violated;
    if (fine && found->violated && !fsm_fairness_lasso(&self, &stable, &unstable, found)) {
        fsm_lasso_free(found);
        found->violated = true;
    }
    fsm_components_free(&unstable);
    fsm_components_free(&stable);
    fsm_fairness_free(&self);
    return fine && search->model->failure(search->model->self) == NULL;
}
