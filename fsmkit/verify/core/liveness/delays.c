#include "liveness/delays.h"

#include "search/scc.h"

#include <stdlib.h>

enum { ENDED = 1, HOLDS = 2, BEGINS = 4, LATE = 8, BEFORE_LATE = 16 };

typedef struct {
    fsm_search *search;
    unsigned char *flags;
    uint32_t *longest; /* by place */
    uint32_t most;
    fsm_steps steps;
    uint64_t looks; /* at states */
    bool failed;
} delays;

static bool look_at(delays *self, uint64_t place)
{
    const fsm_model *model = self->search->model;
    fsm_search *search = self->search;
    if (++self->looks % 1024 == 0 && search->keep_on != NULL && !search->keep_on(search)) {
        self->failed = true;
        return false;
    }
    fsm_steps_clear(&self->steps, 0);
    if (fsm_successors(model, fsm_set_at(&self->search->passed, place), &self->steps))
        return true;
    self->failed = true;
    return false;
}

static uint32_t later(uint32_t time, uint32_t by)
{
    return time > FSM_FOREVER - by ? FSM_FOREVER : time + by;
}

/* What a step takes until the end comes, after it. */
static uint32_t left_after(const delays *self, const fsm_step *step)
{
    uint64_t to = fsm_set_find(&self->search->passed, step->to);
    return later((self->flags[to] & ENDED) != 0 ? 0 : self->longest[to], step->kind == FSM_STEP_TIME);
}

/* Whether nothing stops time in the state looked at, or makes it count. */
static bool is_endless(const delays *self)
{
    for (size_t i = 0; i < self->steps.count; i++)
        if (self->steps.items[i].kind != FSM_STEP_ENVIRONMENT)
            return false;
    return true;
}

static unsigned char close_delayed(void *context, const fsm_components *all, const uint64_t *places, size_t count,
                                   unsigned char leaves)
{
    delays *self = context;
    uint32_t longest = 0;
    (void)leaves;
    for (size_t i = 0; i < count && look_at(self, places[i]); i++) {
        longest = is_endless(self) ? FSM_FOREVER : longest;
        for (size_t s = 0; s < self->steps.count; s++) {
            const fsm_step *step = &self->steps.items[s];
            uint64_t to = fsm_set_find(&self->search->passed, step->to);
            bool inner = (self->flags[to] & ENDED) == 0 && all->low[to] != 0;
            uint32_t takes = !inner ? left_after(self, step) : step->kind == FSM_STEP_TIME ? FSM_FOREVER : 0;
            longest = takes > longest ? takes : longest;
        }
    }
    for (size_t i = 0; i < count; i++)
        self->longest[places[i]] = longest;
    return 0;
}

/* --- start of the measured time
 * ------------------------------------------------------------------------ */

static void flag_states(delays *self, uint32_t begin, uint32_t end)
{
    const fsm_search *search = self->search;
    for (uint64_t place = 0; place < fsm_set_places(&search->passed); place++) {
        if (!fsm_set_taken(&search->passed, place))
            continue;
        fsm_state state = fsm_set_at(&search->passed, place);
        self->flags[place] = (unsigned char)((fsm_is_marked(search->model, state, end) ? ENDED : 0)
                                             | (fsm_is_marked(search->model, state, begin) ? HOLDS : 0));
    }
}

/* Calls for each step by which the time may start, and for each initial state. */
typedef void started(delays *self, uint64_t from, uint64_t to);

static bool each_start(delays *self, started *visit)
{
    const fsm_search *search = self->search;
    fsm_steps initial = {0};
    bool fine = search->model->initial(search->model->self, &initial);
    for (size_t i = 0; fine && i < initial.count; i++) {
        uint64_t to = fsm_set_find(&search->passed, initial.items[i].to);
        if ((self->flags[to] & (HOLDS | ENDED)) == HOLDS)
            visit(self, to, to);
    }
    free(initial.items);
    for (uint64_t from = 0; fine && from < fsm_set_places(&search->passed); from++) {
        if (!fsm_set_taken(&search->passed, from) || (self->flags[from] & HOLDS) != 0)
            continue;
        fine = look_at(self, from);
        for (size_t i = 0; fine && i < self->steps.count; i++) {
            uint64_t to = fsm_set_find(&search->passed, self->steps.items[i].to);
            if ((self->flags[to] & (HOLDS | ENDED)) == HOLDS)
                visit(self, from, to);
        }
    }
    return fine;
}

static void note_beginning(delays *self, uint64_t from, uint64_t to)
{
    (void)from;
    self->flags[to] |= BEGINS;
}

static void note_late(delays *self, uint64_t from, uint64_t to)
{
    if (self->longest[to] <= self->most)
        return;
    self->flags[to] |= LATE;
    self->flags[from] |= BEFORE_LATE;
}

/* --- a path on which it is late ------------------------------------------------------------------------- */

static fsm_path_step path_to_start(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const delays *self = context;
    (void)from;
    return (self->flags[fsm_set_find(&self->search->passed, steps->items[step].to)] & LATE) != 0 ? FSM_ARRIVES
                                                                                                  : FSM_OFF_PATH;
}

/* On to the next unit of time, by steps after which as much of it is left as can be. */
static fsm_path_step path_on(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const delays *self = context;
    const fsm_step *s = &steps->items[step];
    if (left_after(self, s) != self->longest[fsm_set_find(&self->search->passed, from)])
        return FSM_OFF_PATH;
    return s->kind == FSM_STEP_TIME ? FSM_ARRIVES : FSM_GOES_ON;
}

static bool make_path(delays *self, fsm_path *path)
{
    const fsm_search *search = self->search;
    fsm_state at = fsm_path_to_flagged(self->search, self->flags, BEFORE_LATE, path);
    if (at != FSM_NO_STATE && (self->flags[fsm_set_find(&search->passed, at)] & LATE) == 0)
        at = fsm_path_from(search, at, path_to_start, self, path);
    for (uint32_t passed = 0; at != FSM_NO_STATE && passed <= self->most; passed++) {
        uint64_t place = fsm_set_find(&search->passed, at);
        if ((self->flags[place] & ENDED) != 0)
            return true;
        fsm_state next = fsm_path_from(search, at, path_on, self, path);
        if (next == FSM_NO_STATE)
            return true; /* where time does not count any more */
        at = next;
    }
    return at != FSM_NO_STATE;
}

bool fsm_find_delay(fsm_search *search, uint32_t begin, uint32_t end, uint32_t most, fsm_delay *found)
{
    const fsm_set *passed = &search->passed;
    uint64_t places = fsm_set_places(passed);
    delays self = {.search = search, .most = most};
    fsm_components components = {.close = close_delayed, .context = &self};
    fsm_scc walk;
    *found = (fsm_delay){.greatest = 0};
    self.flags = calloc(places, 1);
    self.longest = calloc(places, sizeof *self.longest);
    bool fine = fsm_scc_init(&walk, search);
    fine = fsm_components_init(&components, search) && fine && self.flags != NULL && self.longest != NULL;
    if (fine)
        flag_states(&self, begin, end);
    fine = fine && each_start(&self, note_beginning);
    walk.flags = self.flags;
    walk.outside = ENDED;
    for (uint64_t root = 0; fine && root < places; root++) {
        if (!fsm_set_taken(passed, root) || (self.flags[root] & BEGINS) == 0)
            continue;
        fine = fsm_components_from(&components, &walk, root) && !self.failed;
        found->started = true;
        found->greatest = self.longest[root] > found->greatest ? self.longest[root] : found->greatest;
    }
    found->late.violated = found->greatest > most;
    if (fine && found->late.violated) {
        fine = each_start(&self, note_late);
        if (fine && !make_path(&self, &found->late.path))
            found->late.path.count = 0;
    }
    fsm_components_free(&components);
    fsm_scc_free(&walk);
    free(self.flags);
    free(self.longest);
    free(self.steps.items);
    return fine && search->model->failure(search->model->self) == NULL;
}
