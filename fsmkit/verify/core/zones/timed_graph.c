#include "zones/timed_graph.h"

#include <stdlib.h>
#include <string.h>

/* --- livelock ---------------------------------------------------------------------------------------
 * In a cycle that takes no time only timers of duration 0 can fire again and again. Such steps are
 * possible at least where all clocks are 0, so cycles are sought there, over the discrete parts; one
 * that is found is then gone round from the pairs that were reached. */

typedef struct {
    uint32_t to, number; /* discrete part; the local step */
} edge;

typedef struct {
    uint32_t tuple;
    size_t first, edge, end;
} frame;

typedef struct {
    fsm_timed *timed;
    edge *edges;
    size_t edge_count, edge_room;
    frame *frames;
    size_t frame_count, frame_room;
    fsm_bound *zone;
    uint64_t checks;
    bool failed;
} walk;

static bool push_edge(void *context, const fsm_timed_step *step)
{
    walk *self = context;
    if (step->kind != FSM_STEP_INTERNAL || (step->fires && !step->instant))
        return true;
    uint32_t to = fsm_store_find(&self->timed->tuples, step->tuple);
    if (to == FSM_NONE)
        return true; /* the clocks do not allow it */
    if (self->edge_count == self->edge_room) {
        size_t room = self->edge_room == 0 ? 256 : 2 * self->edge_room;
        edge *edges = realloc(self->edges, room * sizeof *edges);
        if (edges == NULL)
            return !(self->failed = true);
        self->edges = edges;
        self->edge_room = room;
    }
    self->edges[self->edge_count++] = (edge){to, step->number};
    return true;
}

static bool enter(walk *self, uint32_t tuple)
{
    fsm_timed *t = self->timed;
    uint32_t state[FSM_MOST_MACHINES + 1];
    if (++self->checks % 1024 == 0 && t->keep_on != NULL && !t->keep_on(t))
        return false;
    if (self->frame_count == self->frame_room) {
        size_t room = self->frame_room == 0 ? 256 : 2 * self->frame_room;
        frame *frames = realloc(self->frames, room * sizeof *frames);
        if (frames == NULL)
            return false;
        self->frames = frames;
        self->frame_room = room;
    }
    memcpy(state, fsm_store_at(&t->tuples, tuple), t->tuples.state_size);
    fsm_zone_zero(self->zone, fsm_timed_size(t, state));
    size_t first = self->edge_count;
    if (!fsm_timed_successors(t, state, self->zone, true, push_edge, self) || self->failed)
        return false;
    self->frames[self->frame_count++] = (frame){tuple, first, first, self->edge_count};
    return true;
}

/* A step to be found again, by its number; and what it led to. */
/* Goes round from a pair until the zone stays the same; false if the clocks do not allow that. */
static bool go_round(fsm_timed *t, uint32_t pair, const edge *cycle, uint32_t count, fsm_bound *last,
                     fsm_timed_sought *s, fsm_timed_cycle *found)
{
    enum { ROUNDS = FSM_MOST_CLOCKS + 2 };
    found->length = 0;
    memcpy(s->tuple, fsm_timed_tuple(t, pair), t->tuples.state_size);
    s->size = fsm_timed_size(t, s->tuple);
    fsm_zones_read(&t->zones, t->pairs[pair].zone, s->size, s->zone);
    for (uint32_t round = 0; round < ROUNDS; round++) {
        uint32_t size = s->size;
        memcpy(last, s->zone, (size_t)size * size * sizeof *last);
        uint32_t *path = realloc(found->path, ((size_t)found->length + count) * sizeof *path);
        if (path == NULL)
            return false;
        found->path = path;
        found->lead = found->length;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t tuple[FSM_MOST_MACHINES + 1];
            memcpy(tuple, s->tuple, t->tuples.state_size);
            memcpy(t->before, s->zone, (size_t)s->size * s->size * sizeof *s->zone);
            s->wanted = cycle[i].number;
            s->at = 0;
            s->ordinal = FSM_NONE;
            (void)fsm_timed_successors(t, tuple, t->before, true, fsm_timed_pick, s);
            if (s->ordinal == FSM_NONE)
                return false;
            found->path[found->length++] = s->ordinal;
        }
        if (s->size == size && memcmp(last, s->zone, (size_t)size * size * sizeof *last) == 0) {
            found->pair = pair;
            return true;
        }
    }
    return false;
}

/* The edges from a discrete part on the stack back to itself. */
static bool follow_up(walk *self, uint32_t start, fsm_timed_cycle *found)
{
    fsm_timed *t = self->timed;
    size_t first = self->frame_count;
    while (self->frames[first - 1].tuple != start)
        first--;
    first--;
    uint32_t count = (uint32_t)(self->frame_count - first);
    edge *cycle = malloc(count * sizeof *cycle);
    fsm_bound *last = malloc(FSM_ZONE_ROOM * sizeof *last);
    fsm_timed_sought s = {.machines = t->composition->system->machine_count, .zone = malloc(FSM_ZONE_ROOM * sizeof *last)};
    bool fine = cycle != NULL && last != NULL && s.zone != NULL;
    for (uint32_t i = 0; fine && i < count; i++)
        cycle[i] = self->edges[self->frames[first + i].edge - 1];
    const fsm_family *family = &t->families[start];
    for (uint32_t i = 0; fine && i < family->count && found->pair == FSM_NONE; i++)
        (void)go_round(t, family->entries[i].pair, cycle, count, last, &s, found);
    free(cycle);
    free(last);
    free(s.zone);
    return fine && found->pair != FSM_NONE;
}

static bool walk_from(walk *self, uint32_t root, unsigned char *colour, fsm_timed_cycle *found)
{
    enum { WHITE, GREY, BLACK };
    if (!enter(self, root))
        return false;
    colour[root] = GREY;
    while (self->frame_count > 0) {
        frame *at = &self->frames[self->frame_count - 1];
        if (at->edge == at->end) {
            colour[at->tuple] = BLACK;
            self->edge_count = at->first;
            self->frame_count--;
            continue;
        }
        uint32_t to = self->edges[at->edge++].to;
        if (colour[to] == GREY)
            return follow_up(self, to, found);
        if (colour[to] == WHITE) {
            if (!enter(self, to))
                return false;
            colour[to] = GREY;
        }
    }
    return true;
}

bool fsm_timed_livelock(fsm_timed *self, fsm_timed_cycle *found)
{
    *found = (fsm_timed_cycle){.pair = FSM_NONE};
    if (!self->internal_back_edge)
        return true; /* each cycle holds a step to a discrete part no newer than its source */
    walk w = {.timed = self, .zone = malloc(FSM_ZONE_ROOM * sizeof *w.zone)};
    unsigned char *colour = calloc(self->tuples.count + 1u, 1);
    bool fine = w.zone != NULL && colour != NULL;
    for (uint32_t root = 0; fine && found->pair == FSM_NONE && root < self->tuples.count; root++)
        if (colour[root] == 0)
            fine = walk_from(&w, root, colour, found);
    free(colour);
    free(w.zone);
    free(w.edges);
    free(w.frames);
    return fine;
}

/* --- traps --------------------------------------------------------------------------------------------
 * A pair gets away if some path leads to where another configuration is shown. All points of a zone get
 * away for sure if that path can be taken by each of them: by a step that no clock hinders, or whichever
 * timer fires next. */

typedef struct {
    uint32_t from, to;
    bool fires;
} arc;

typedef struct {
    fsm_timed *timed;
    uint32_t from;
    arc *arcs;
    size_t count, room;
    bool failed;
} arcs;

static bool push_arc(void *context, const fsm_timed_step *step)
{
    arcs *self = context;
    uint32_t to = fsm_timed_find(self->timed, step);
    if (self->count == self->room) {
        size_t room = self->room == 0 ? 256 : 2 * self->room;
        arc *items = realloc(self->arcs, room * sizeof *items);
        if (items == NULL)
            return !(self->failed = true);
        self->arcs = items;
        self->room = room;
    }
    if (to == FSM_NONE)
        return !(self->failed = true);
    self->arcs[self->count++] = (arc){self->from, to, step->fires};
    return true;
}

static bool is_kept(const fsm_timed *self, uint32_t pair)
{
    const fsm_family *family = &self->families[self->pairs[pair].tuple];
    for (uint32_t i = 0; i < family->count; i++)
        if (family->entries[i].pair == pair)
            return true;
    return false;
}

static bool find_arcs(arcs *self)
{
    fsm_timed *t = self->timed;
    uint32_t tuple[FSM_MOST_MACHINES + 1];
    for (self->from = 0; self->from < t->pair_count; self->from++) {
        if (self->from % 1024 == 0 && t->keep_on != NULL && !t->keep_on(t))
            return false;
        if (!is_kept(t, self->from))
            continue;
        memcpy(tuple, fsm_timed_tuple(t, self->from), t->tuples.state_size);
        fsm_zones_read(&t->zones, t->pairs[self->from].zone, fsm_timed_size(t, tuple), t->before);
        if (!fsm_timed_successors(t, tuple, t->before, false, push_arc, self) || self->failed)
            return false;
    }
    return true;
}

static uint32_t shown(const fsm_timed *self, uint32_t pair)
{
    return fsm_flat_configuration(self->composition, fsm_timed_tuple(self, pair));
}

/* Returns whether an arc leads out, given the pairs that escape. */
static bool leads_out(const fsm_timed *self, arc a, const unsigned char *away)
{
    return away[a.to] || shown(self, a.from) != shown(self, a.to);
}

/* One pass; true if a pair was added. `hinders` is room for a mark of each pair: some timer that may
 * fire next does not lead out. */
static bool spread(const arcs *graph, unsigned char *away, unsigned char *surely, unsigned char *hinders)
{
    const fsm_timed *t = graph->timed;
    bool added = false;
    memset(hinders, 0, t->pair_count);
    for (size_t i = graph->count; i-- > 0;) {
        arc a = graph->arcs[i];
        if (!away[a.from] && leads_out(t, a, away))
            added = (away[a.from] = 1);
        bool out = leads_out(t, a, surely);
        if (a.fires)
            hinders[a.from] |= out ? 2 : 1;
        else if (!surely[a.from] && out)
            added = (surely[a.from] = 1);
    }
    for (uint32_t pair = 0; pair < t->pair_count; pair++)
        if (hinders[pair] == 2 && !surely[pair])
            added = (surely[pair] = 1);
    return added;
}

bool fsm_timed_traps(fsm_timed *self, void (*report)(void *context, uint32_t pair), void *context, bool *doubt)
{
    arcs graph = {.timed = self};
    unsigned char *away = calloc(self->pair_count + 1u, 1), *surely = calloc(self->pair_count + 1u, 1);
    unsigned char *hinders = calloc(self->pair_count + 1u, 1);
    bool fine = away != NULL && surely != NULL && hinders != NULL && find_arcs(&graph);
    while (fine && spread(&graph, away, surely, hinders))
        fine = self->keep_on == NULL || self->keep_on(self);
    *doubt = false;
    for (uint32_t pair = 0; fine && pair < self->pair_count; pair++) {
        if (surely[pair] || !is_kept(self, pair) || fsm_flat_at_rest(self->composition, fsm_timed_tuple(self, pair)))
            continue;
        if (!away[pair])
            report(context, pair);
        else
            *doubt = true;
    }
    free(graph.arcs);
    free(away);
    free(surely);
    free(hinders);
    return fine;
}
