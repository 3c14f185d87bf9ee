#include "liveness/fairness.h"

#include <stdlib.h>
#include <string.h>

bool fsm_fairness_init(fsm_fairness *self, fsm_search *search)
{
    size_t actions = (size_t)search->model->action_count + 1;
    *self = (fsm_fairness){.search = search};
    self->flags = calloc(fsm_set_places(&search->passed), 1);
    self->here = malloc(actions);
    self->always = malloc(actions);
    self->taken = malloc(actions);
    return self->flags != NULL && self->here != NULL && self->always != NULL && self->taken != NULL;
}

void fsm_fairness_free(fsm_fairness *self)
{
    free(self->flags);
    free(self->here);
    free(self->always);
    free(self->taken);
    free(self->steps.items);
    free(self->actions);
    free(self->ended);
}

static bool fail(fsm_fairness *self)
{
    self->failed = true;
    return false;
}

static bool make_room(fsm_fairness *self)
{
    size_t room = 2 * self->steps.count;
    if (self->steps.count <= self->action_room)
        return true;
    uint32_t *actions = realloc(self->actions, room * sizeof *actions);
    self->actions = actions != NULL ? actions : self->actions;
    uint64_t *ended = realloc(self->ended, room * sizeof *ended);
    self->ended = ended != NULL ? ended : self->ended;
    if (actions == NULL || ended == NULL)
        return fail(self);
    memset(ended, 0, room * sizeof *ended);
    self->action_room = room;
    return true;
}

/* Fills in `steps`, `actions`, and in `here` which of these are possible; `running` and `ended`. */
static bool look_at(fsm_fairness *self, fsm_state state, bool *stable)
{
    const fsm_model *model = self->search->model;
    fsm_search *search = self->search;
    if (++self->looks % 1024 == 0 && search->keep_on != NULL && !search->keep_on(search))
        return fail(self);
    fsm_steps_clear(&self->steps, 0);
    if (!fsm_successors(model, state, &self->steps))
        return fail(self);
    if (!make_room(self))
        return false;
    if (self->steps.count > 0 && !model->fair(model->self, state, &self->steps, self->actions))
        return fail(self);
    if (model->running != NULL)
        self->running = model->running(model->self, state, &self->steps, self->ended);
    memset(self->here, 0, model->action_count);
    *stable = true;
    for (size_t i = 0; i < self->steps.count; i++) {
        *stable = *stable && self->steps.items[i].kind != FSM_STEP_INTERNAL;
        if (self->actions[i] != FSM_NONE)
            self->here[self->actions[i]] = 1;
    }
    if (model->armed != NULL)
        model->armed(model->self, state, self->here);
    return true;
}

static bool is_any(const fsm_fairness *self, const unsigned char *set)
{
    return memchr(set, 1, self->search->model->action_count) != NULL;
}

bool fsm_fairness_flag_stable(fsm_fairness *self)
{
    const fsm_set *passed = &self->search->passed;
    for (uint64_t place = 0; place < fsm_set_places(passed); place++) {
        bool stable;
        if (!fsm_set_taken(passed, place) || (self->flags[place] & FSM_ANSWERED) != 0)
            continue;
        if (!look_at(self, fsm_set_at(passed, place), &stable))
            return false;
        self->flags[place] |= stable ? FSM_STABLE : 0;
    }
    return true;
}

/* --- components ----------------------------------------------------------------------------------------- */

/* Notes what was seen of the state looked at: the steps that stay in the component. True if there are any. */
static bool note_inner(fsm_fairness *self, const fsm_components *all, uint64_t *ended)
{
    bool inner = false;
    for (size_t i = 0; i < self->steps.count; i++) {
        uint64_t to = fsm_set_find(&self->search->passed, self->steps.items[i].to);
        if (to == FSM_NOWHERE || (self->flags[to] & self->outside) != 0 || all->low[to] == 0)
            continue;
        inner = true;
        if (self->actions[i] != FSM_NONE)
            self->taken[self->actions[i]] = 1;
        *ended |= self->ended[i];
    }
    return inner;
}

bool fsm_fairness_evaluate(fsm_fairness *self, const fsm_components *all, const uint64_t *places, size_t count)
{
    uint32_t actions = self->search->model->action_count;
    bool inner = false, counted = false, ends = false;
    uint64_t running = UINT64_MAX, ended = 0; /* machines at all stable states; in some step */
    memset(self->always, 1, actions);
    memset(self->taken, 0, actions);
    for (size_t i = 0; i < count; i++) {
        bool stable;
        if (!look_at(self, fsm_set_at(&self->search->passed, places[i]), &stable))
            return false;
        inner = note_inner(self, all, &ended) || inner;
        if (!stable && !self->unstable)
            continue;
        counted = true;
        running &= self->running;
        for (uint32_t a = 0; a < actions; a++)
            self->always[a] &= self->here[a];
        if (stable && !is_any(self, self->here) && self->running == 0) {
            self->flags[places[i]] |= FSM_ENDS;
            ends = true;
        }
    }
    for (uint32_t a = 0; a < actions; a++)
        self->always[a] &= !self->taken[a];
    bool fair = inner && counted && !is_any(self, self->always) && (running & ~ended) == 0;
    for (size_t i = 0; fair && i < count; i++)
        self->flags[places[i]] |= self->unstable ? FSM_ENDLESS : FSM_FAIR;
    return fair || ends;
}

/* --- a run ------------------------------------------------------------------------------------------------ */

static unsigned char flags_of(const fsm_fairness *self, fsm_state state)
{
    return self->flags[fsm_set_find(&self->search->passed, state)];
}

/* To where a fair run may stay, without an answer. */
static fsm_path_step path_to_core(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const fsm_fairness *self = context;
    unsigned char flags = flags_of(self, steps->items[step].to);
    (void)from;
    return (flags & FSM_ANSWERED) != 0                           ? FSM_OFF_PATH
        : (flags & (FSM_ENDS | FSM_FAIR | FSM_ENDLESS)) != 0     ? FSM_ARRIVES
                                                                 : FSM_GOES_ON;
}

/* A cycle through a component: `open` contains the conditions that it must still meet. */
typedef struct {
    fsm_fairness *fairness;
    const fsm_components *all;
    uint32_t number; /* of the component */
    bool unstable, stable_seen;
    fsm_state first;
    unsigned char *open;      /* actions that were neither taken nor impossible so far */
    uint64_t running;         /* machines whose first timers all states so far had, and no step ended */
} round_trip;

static bool is_inside(const round_trip *self, fsm_state state)
{
    uint64_t place = fsm_set_find(&self->fairness->search->passed, state);
    unsigned char outside = self->unstable ? FSM_ANSWERED | FSM_STABLE : FSM_ANSWERED;
    return (self->fairness->flags[place] & outside) == 0 && self->all->index[place] == self->number;
}

/* Looks at a state; true if something that must be seen is seen there. `close`: it need not be any more. */
static bool see(round_trip *self, fsm_state state, bool close)
{
    fsm_fairness *f = self->fairness;
    bool stable, news;
    if (!look_at(f, state, &stable) || (!stable && !self->unstable))
        return false;
    news = !self->stable_seen;
    self->stable_seen = self->stable_seen || close;
    news = news || (self->running & ~f->running) != 0;
    self->running &= close ? f->running : UINT64_MAX;
    for (uint32_t a = 0; a < f->search->model->action_count; a++) {
        news = news || (self->open[a] && !f->here[a]);
        self->open[a] &= close ? f->here[a] : 1;
    }
    return news;
}

/* The attributes of a step: its action, and the machines whose first timers it ends. */
typedef struct {
    uint32_t action;
    uint64_t ended;
} edge_signature;

static edge_signature signature_of(fsm_fairness *self, fsm_state from, size_t step)
{
    bool stable;
    if (!look_at(self, from, &stable))
        return (edge_signature){FSM_NONE, 0};
    return (edge_signature){self->actions[step], self->ended[step]};
}

static fsm_path_step path_around(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    round_trip *self = context;
    fsm_state to = steps->items[step].to;
    if (!is_inside(self, to))
        return FSM_OFF_PATH;
    edge_signature done = signature_of(self->fairness, from, step);
    bool news = (done.action != FSM_NONE && self->open[done.action]) || (self->running & done.ended) != 0
        || see(self, to, false);
    return news ? FSM_ARRIVES : FSM_GOES_ON;
}

static fsm_path_step path_back(void *context, const fsm_steps *steps, size_t step, fsm_state from)
{
    const round_trip *self = context;
    fsm_state to = steps->items[step].to;
    (void)from;
    return !is_inside(self, to) ? FSM_OFF_PATH : to == self->first ? FSM_ARRIVES : FSM_GOES_ON;
}

static bool go_round(round_trip *self, fsm_path *cycle)
{
    fsm_fairness *f = self->fairness;
    const fsm_model *model = f->search->model;
    fsm_state at = self->first;
    memset(self->open, 1, model->action_count);
    (void)see(self, at, true);
    while (!self->stable_seen || is_any(f, self->open) || self->running != 0) {
        fsm_state from = at;
        size_t before = cycle->count;
        at = fsm_path_from(f->search, from, path_around, self, cycle);
        if (at == FSM_NO_STATE || cycle->count == before || f->failed)
            return false;
        fsm_state last = from; /* that of the last step */
        for (size_t i = before; i < cycle->count; i++) {
            edge_signature done = signature_of(f, last, cycle->steps[i]);
            if (done.action != FSM_NONE)
                self->open[done.action] = 0;
            self->running &= ~done.ended;
            last = f->steps.items[cycle->steps[i]].to;
            (void)see(self, last, true);
        }
    }
    return (cycle->count > 0 && at == self->first) || fsm_path_from(f->search, at, path_back, self, cycle) != FSM_NO_STATE;
}

bool fsm_fairness_lasso(fsm_fairness *self, const fsm_components *stable, const fsm_components *unstable,
                        fsm_lasso *found)
{
    enum { CORE = FSM_ENDS | FSM_FAIR | FSM_ENDLESS };
    fsm_state at = fsm_path_to_flagged(self->search, self->flags, FSM_HOPELESS, &found->path);
    if (at != FSM_NO_STATE && (flags_of(self, at) & CORE) == 0)
        at = fsm_path_from(self->search, at, path_to_core, self, &found->path);
    if (at == FSM_NO_STATE)
        return false;
    unsigned char flags = flags_of(self, at);
    if ((flags & FSM_ENDS) != 0)
        return true;
    round_trip trip = {.fairness = self, .all = (flags & FSM_FAIR) != 0 ? stable : unstable,
                       .unstable = (flags & FSM_FAIR) == 0, .first = at};
    trip.number = trip.all->index[fsm_set_find(&self->search->passed, at)];
    trip.stable_seen = trip.unstable;
    trip.running = UINT64_MAX;
    trip.open = malloc((size_t)self->search->model->action_count + 1);
    bool fine = trip.open != NULL && go_round(&trip, &found->cycle);
    free(trip.open);
    return fine;
}
