#define _POSIX_C_SOURCE 200809L
#include "symbolic/rival.h"

#include "slots/slots.h"
#include "symbolic/split.h"
#include "symbolic/symbolic.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum {
    DEARER = 4, /* a step of the search costs as much as so many events applied to nodes */
    AT_ONCE = 1 << 20, /* events between two questions whether there is time */
    FEWER = 16  /* the part of the counted states after which the diagram may start after the
                 * search */
};

typedef enum { NOT_STARTED, PAUSED, RUNNING, ENDED, DROPPED } phase;

struct fsm_rival {
    fsm_search *search;
    fsm_composition *composition;
    fsm_composition *own; /* of the diagram, if a queue may be levels: then it makes local states that are never reached */
    const fsm_diagram_options *options;
    fsm_diagram *diagram;
    uint64_t from, transitions, allowed;
    uint64_t looked_at; /* local states of a machine, when it was looked at last */
    size_t memory;
    bool answered; /* the diagram is complete */
    bool abandoned;
    phase phase;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
};

static fsm_rival *at_hand; /* a search knows its pace only */

/* --- turns ---------------------------------------------------------------------------------------------- */

static void set_phase(fsm_rival *self, phase now)
{
    (void)pthread_mutex_lock(&self->mutex);
    self->phase = now;
    (void)pthread_cond_broadcast(&self->changed);
    (void)pthread_mutex_unlock(&self->mutex);
}

static void await_phase(fsm_rival *self, bool running)
{
    (void)pthread_mutex_lock(&self->mutex);
    while ((self->phase == RUNNING) != running)
        (void)pthread_cond_wait(&self->changed, &self->mutex);
    (void)pthread_mutex_unlock(&self->mutex);
}

/* Called by the diagram now and then. */
static void pause(void *context)
{
    fsm_rival *self = context;
    if (fsm_diagram_work(self->diagram) < self->allowed && !self->abandoned)
        return;
    set_phase(self, PAUSED);
    await_phase(self, true);
    if (self->abandoned)
        fsm_diagram_stop(self->diagram);
}

static void search_with_diagram(void *context)
{
    fsm_rival *self = context;
    fsm_diagram_search(self->diagram);
}

static void *serve(void *context)
{
    fsm_rival *self = context;
    (void)fsm_on_stack(fsm_most_levels(&fsm_the_system), search_with_diagram, self);
    set_phase(self, ENDED);
    return NULL;
}

static void free_diagram(fsm_rival *self)
{
    fsm_diagram_free(self->diagram);
    if (self->own != NULL)
        fsm_composition_free(self->own);
    self->diagram = NULL;
    self->own = NULL;
    self->phase = DROPPED;
}

static bool may_have_slots(void)
{
    bool found = false;
    for (uint32_t i = 0; i < fsm_the_system.machine_count; i++)
        found = found || fsm_slots_can(&fsm_the_system, NULL, i);
    return found;
}

static bool begin(fsm_rival *self, size_t memory)
{
    bool own = may_have_slots();
    if (own)
        self->own = fsm_compose(&fsm_the_system, memory);
    if (!own || self->own != NULL)
        self->diagram = fsm_diagram_make(self->options, own ? self->own : self->composition, memory, pause, self);
    self->abandoned = false;
    self->phase = RUNNING;
    if (self->diagram != NULL && pthread_create(&self->thread, NULL, serve, self) == 0)
        return true;
    free_diagram(self);
    return false;
}

static void drop(fsm_rival *self)
{
    if (self->phase == NOT_STARTED || self->phase == DROPPED)
        return;
    if (self->phase == PAUSED) {
        self->abandoned = true;
        set_phase(self, RUNNING);
        await_phase(self, false);
    }
    (void)pthread_join(self->thread, NULL);
    free_diagram(self);
}

static void give_turn(fsm_rival *self)
{
    if (self->phase == PAUSED)
        set_phase(self, RUNNING);
    await_phase(self, false);
}

/* --- the search --------------------------------------------------------------------------------------------- */

static bool has_answer(const fsm_rival *self)
{
    return fsm_diagram_outcome(self->diagram) == FSM_COMPLETE && fsm_diagram_is_sound(self->diagram)
        && fsm_diagram_answers_all(self->diagram);
}

/* Whether most local states of a machine differ by what waits in its queue, and there are many already. These cost more to
 * find than states of a system, and do not end soon; as levels, slots of a queue are cheap. */
static bool has_long_queue(fsm_rival *self)
{
    enum { EARLIER = 16, MORE = 8 };
    const fsm_composition *c = self->composition;
    uint64_t most = self->looked_at;
    bool found = false;
    for (uint32_t i = 0; i < c->system->machine_count; i++) {
        uint32_t count = c->locals[i].count, queueless = 0;
        if (count < self->from / EARLIER || count < 2 * self->looked_at || !fsm_slots_can(c->system, NULL, i))
            continue;
        for (uint32_t local = 0; local < count; local++)
            queueless += fsm_info(c, i, local)->view.queued == 0;
        found = found || count / MORE > queueless;
        most = count > most ? count : most;
    }
    self->looked_at = most;
    return found;
}

static bool is_to_start(fsm_rival *self)
{
    return self->search->passed.count >= self->from || has_long_queue(self);
}

static bool keep_on(fsm_search *search)
{
    fsm_rival *self = at_hand;
    if (!fsm_keep_pace(search))
        return false;
    if (self->phase == DROPPED || (self->phase == NOT_STARTED && !is_to_start(self)))
        return true;
    self->allowed += DEARER * (search->transitions - self->transitions);
    self->transitions = search->transitions;
    if (self->phase == NOT_STARTED) {
        search->memory_limit = self->memory / 4 * 3;
        self->allowed = 0;
        (void)begin(self, self->memory / 4);
    }
    if (self->phase != DROPPED)
        give_turn(self);
    if (self->phase == ENDED && has_answer(self)) {
        self->answered = true;
        search->outcome = FSM_DECIDED; /* what it has seen is shown by it */
    } else if (self->phase == ENDED) {
        drop(self);
    }
    if (self->phase == DROPPED)
        search->memory_limit = self->memory;
    return search->outcome == FSM_COMPLETE;
}

fsm_rival *fsm_rival_join(fsm_search *search, fsm_composition *composition, const fsm_diagram_options *options, uint64_t from)
{
    fsm_rival *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    *self = (fsm_rival){.search = search, .composition = composition, .options = options, .from = from,
                        .memory = search->memory_limit, .phase = NOT_STARTED};
    (void)pthread_mutex_init(&self->mutex, NULL);
    (void)pthread_cond_init(&self->changed, NULL);
    at_hand = self;
    search->keep_on = keep_on;
    return self;
}

/* --- the end --------------------------------------------------------------------------------------------------- */

static bool has_time(fsm_rival *self)
{
    const fsm_search *search = self->search;
    const fsm_progress progress = {search->expanded, search->transitions, search->depth, 0};
    return fsm_pace_check(self->options->pace, progress) == FSM_COMPLETE;
}

/* The search knows all states, but not whether there are fair runs without an answer. Each such question takes passes over all
 * steps again, mostly many of them; so the diagram has as much time as one for each. */
static void catch_up(fsm_rival *self)
{
    const fsm_search *search = self->search;
    uint64_t passes = 0;
    for (uint32_t i = 0; i < self->options->temporal_count; i++)
        passes += strcmp(self->options->temporal[2 * i], "--leads-to") == 0;
    if (passes == 0 || search->passed.count < self->from / FEWER)
        return;
    if (self->phase == NOT_STARTED && begin(self, self->memory / 4))
        await_phase(self, false);
    const uint64_t most = self->allowed + DEARER * passes * search->transitions;
    while (self->phase == PAUSED && self->allowed < most && has_time(self)) {
        self->allowed += most - self->allowed < AT_ONCE ? most - self->allowed : AT_ONCE;
        give_turn(self);
    }
    self->answered = self->phase == ENDED && has_answer(self);
}

bool fsm_rival_wins(fsm_rival *self, double started)
{
    fsm_search *search = self->search;
    fsm_diagram_paths ways = {NULL, search};
    if (!self->answered && search->outcome == FSM_COMPLETE)
        catch_up(self);
    if (!self->answered && search->outcome != FSM_OUT_OF_MEMORY) {
        drop(self);
        return false;
    }
    if (!self->answered) { /* the search has no more memory: the diagram goes on alone */
        fsm_search_forget(search);
        if (self->phase == NOT_STARTED || self->phase == DROPPED)
            (void)begin(self, self->memory / 2);
        else
            fsm_diagram_set_memory(self->diagram, self->memory / 2);
        while (self->phase != DROPPED && self->phase != ENDED) {
            self->allowed += AT_ONCE;
            give_turn(self);
            if (!has_time(self))
                self->abandoned = true;
        }
        if (self->phase == DROPPED || fsm_diagram_outcome(self->diagram) != FSM_COMPLETE || !fsm_diagram_is_sound(self->diagram)) {
            drop(self);
            return false;
        }
    }
    ways.diagram = self->diagram;
    fsm_diagram_go_alone(self->diagram);
    (void)fsm_on_stack(fsm_most_levels(&fsm_the_system), fsm_diagram_find_paths, &ways);
    fsm_diagram_print(self->diagram, started);
    return true;
}

void fsm_rival_free(fsm_rival *self)
{
    if (self == NULL)
        return;
    drop(self);
    self->search->keep_on = fsm_keep_pace; /* others go on with what it found */
    self->search->memory_limit = self->memory;
    at_hand = NULL;
    (void)pthread_mutex_destroy(&self->mutex);
    (void)pthread_cond_destroy(&self->changed);
    free(self);
}
