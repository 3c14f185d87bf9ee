#include "zones/timed_backward.h"

#include "store/room.h"

#include <stdlib.h>
#include <string.h>

enum {
    FEW_SPLITS = 1000, MOST_SPLITS = 100000, /* of a zone, in one comparison with a union */
    MOST_PIECES = 200000,                    /* of a hull; finer graphs come after it */
    CHECK_EVERY = 256, CHECK_SPLITS = 1 << 16    /* between two calls of `keep_on` */
};

/* Propagates the points of a step from the zone after it to the zone before it. */
typedef enum {
    PASS_AT_ONCE, /* the state is entered without any time */
    PASS_LATER,   /* the state is stable: time may pass after the step */
    PASS_WAIT     /* time passes, until a timer expires */
} passage;

/* A step between two states. Its zones are in `bounds`: first the points that can take it, then those to which it leads, before
 * time passes; then, as numbers, the source of each clock. */
typedef struct {
    uint32_t from;      /* the node it starts in */
    uint32_t next;      /* the next one to the same node; FSM_NONE: none */
    uint32_t size, size_after;
    size_t bounds;
    passage passes;
} edge;

/* Points of a node that reach the goal. */
typedef struct {
    uint32_t node, next; /* the next one of the node; FSM_NONE: none */
    size_t bounds;
    bool done;           /* it was passed on, or another one of the node holds it */
} piece;

typedef struct {
    fsm_timed_model *model;
    fsm_search *search;
    fsm_bound *bounds;
    edge *edges;
    piece *pieces;             /* in the order in which they are passed on */
    size_t bound_count, bound_room, edge_count, edge_room, piece_count, piece_room;
    uint32_t *edges_to, *pieces_of; /* by node: the first one; FSM_NONE: none */
    unsigned char *whole;      /* by node: all its points reach the goal */
    uint32_t *added, *compared; /* by node: pieces added, and how many when their union was compared with the node */
    uint32_t *wholes;          /* the pieces that are whole nodes; these are passed on first */
    uint32_t whole_count, whole_next;
    uint32_t splits, most_splits; /* of the current comparison */
    uint64_t all_splits;

    /* the node whose steps are enumerated */
    uint32_t from, size;
    fsm_limits *limits;
    fsm_bound *zone, *part, *end, *result, *hull;
    bool failed;
} backward;

static bool fail(backward *self)
{
    self->failed = true;
    return false;
}

/* Now and then: whether there is time and memory to go on. */
static bool may_go_on(backward *self, uint64_t count, uint32_t every)
{
    fsm_search *search = self->search;
    if (count % every != 0)
        return true;
    size_t bytes = self->bound_room * sizeof *self->bounds + self->edge_room * sizeof *self->edges + self->piece_room * sizeof *self->pieces;
    return (bytes <= search->memory_limit / 2 && (search->keep_on == NULL || search->keep_on(search))) || fail(self);
}

/* --- memory --------------------------------------------------------------------------------------------- */

static bool add_bounds(backward *self, const fsm_bound *bounds, size_t count)
{
    while (self->bound_count + count > self->bound_room)
        if (!FSM_HAS_ROOM(self->bounds, self->bound_room, self->bound_room, 4096))
            return fail(self);
    memcpy(self->bounds + self->bound_count, bounds, count * sizeof *bounds);
    self->bound_count += count;
    return true;
}

/* --- nodes ---------------------------------------------------------------------------------------------- */

static const uint32_t *tuple_of(const backward *self, uint32_t node)
{
    return fsm_store_at(&self->model->timed.tuples, fsm_left(self->model->nodes[node].state) >> 1);
}

static uint32_t read_zone(const backward *self, uint32_t node, fsm_bound *zone)
{
    uint32_t size = fsm_timed_size(&self->model->timed, tuple_of(self, node));
    fsm_zones_read(&self->model->timed.zones, fsm_right(self->model->nodes[node].state), size, zone);
    return size;
}

/* The node that holds points of a part. */
static uint32_t node_with(backward *self, uint32_t part, const fsm_bound *zone, uint32_t size)
{
    fsm_timed_model *m = self->model;
    const fsm_family *family = &m->covers[part];
    if (!fsm_zones_hold(&m->timed.zones, zone, size))
        return FSM_NONE;
    for (uint32_t i = 0; i < family->count; i++)
        if (fsm_zones_covers(&m->timed.zones, family->entries[i].zone, NULL))
            return (uint32_t)(fsm_timed_node_of(m, fsm_join(part, family->entries[i].zone)) - m->nodes);
    return FSM_NONE;
}

/* --- points that reach the goal -------------------------------------------------------------------------- */

static bool add_piece(backward *self, uint32_t node, const fsm_bound *zone, uint32_t size)
{
    if (!FSM_HAS_ROOM(self->pieces, self->piece_count, self->piece_room, 1024))
        return fail(self);
    self->pieces[self->piece_count] = (piece){node, self->pieces_of[node], self->bound_count, false};
    self->pieces_of[node] = (uint32_t)self->piece_count++;
    return add_bounds(self, zone, (size_t)size * size);
}

/* Returns whether the pieces of a list cover a zone: the rest after each piece must be covered by later ones. */
static bool is_in_union(backward *self, const fsm_bound *zone, uint32_t size, uint32_t first)
{
    size_t cells = (size_t)size * size;
    if (first == FSM_NONE || ++self->splits > self->most_splits || !may_go_on(self, ++self->all_splits, CHECK_SPLITS))
        return false;
    const fsm_bound *held = self->bounds + self->pieces[first].bounds;
    uint32_t next = self->pieces[first].next;
    fsm_bound *rest = malloc(2 * cells * sizeof *rest), *outside = rest + cells;
    if (rest == NULL)
        return fail(self);
    memcpy(rest, zone, cells * sizeof *rest);
    memcpy(outside, zone, cells * sizeof *outside);
    bool meets = fsm_zone_intersect(outside, held, size), in = meets || is_in_union(self, zone, size, next);
    for (uint32_t at = 0; meets && in && at < cells; at++) {
        uint32_t i = at / size, j = at % size;
        if (held[at] >= rest[at])
            continue;
        memcpy(outside, rest, cells * sizeof *outside);
        in = !fsm_zone_cut(outside, size, j, i, 1 - held[at]) || is_in_union(self, outside, size, next);
        (void)fsm_zone_cut(rest, size, i, j, held[at]); /* not empty: the zones meet */
    }
    free(rest);
    return in;
}

/* Whether all points of a node are known to reach the goal; its zone then is in `zone`. */
static bool is_whole(backward *self, uint32_t node, uint32_t most_splits)
{
    uint32_t size = read_zone(self, node, self->zone);
    self->splits = 0;
    self->most_splits = most_splits;
    return self->whole[node] || is_in_union(self, self->zone, size, self->pieces_of[node]);
}

/* Notes that all points of a node reach the goal. */
static bool note_whole(backward *self, uint32_t node)
{
    uint32_t size = read_zone(self, node, self->hull);
    for (uint32_t at = self->pieces_of[node]; at != FSM_NONE; at = self->pieces[at].next)
        self->pieces[at].done = true;
    self->pieces_of[node] = FSM_NONE;
    self->whole[node] = 1;
    self->wholes[self->whole_count++] = (uint32_t)self->piece_count;
    return add_piece(self, node, self->hull, size);
}

/* Whether two zones are one together: what the least zone that holds both has beyond the first one is in the second one. */
static bool is_convex(backward *self, const fsm_bound *first, const fsm_bound *second, uint32_t size)
{
    uint32_t cells = size * size;
    fsm_bound *all = self->hull, *outside = self->zone;
    for (uint32_t i = 0; i < cells; i++)
        all[i] = first[i] > second[i] ? first[i] : second[i];
    for (uint32_t at = 0; at < cells; at++) {
        if (first[at] >= all[at])
            continue;
        memcpy(outside, all, cells * sizeof *outside);
        if (fsm_zone_cut(outside, size, at % size, at / size, 1 - first[at]) && !fsm_zone_covers(second, outside, size, NULL))
            return false;
    }
    return true;
}

/* Drops the pieces of a node that a zone holds, and puts one that makes a zone together with it into it; true if there was one. */
static bool take_in(backward *self, uint32_t node, fsm_bound *zone, uint32_t size)
{
    size_t bytes = (size_t)size * size * sizeof *zone;
    for (uint32_t *link = &self->pieces_of[node]; *link != FSM_NONE;) {
        piece *other = &self->pieces[*link];
        const fsm_bound *held = self->bounds + other->bounds;
        bool holds = fsm_zone_covers(zone, held, size, NULL), joins = !holds && is_convex(self, zone, held, size);
        if (!holds && !joins) {
            link = &other->next;
            continue;
        }
        other->done = true;
        *link = other->next;
        if (joins) {
            memcpy(zone, self->hull, bytes);
            return true;
        }
    }
    return false;
}

/* Adds points, which are in `result`, to those of a node that reach the goal. */
static bool add_points(backward *self, uint32_t node, uint32_t size)
{
    if (self->whole[node])
        return true;
    for (uint32_t at = self->pieces_of[node]; at != FSM_NONE; at = self->pieces[at].next)
        if (fsm_zone_covers(self->bounds + self->pieces[at].bounds, self->result, size, NULL))
            return true;
    while (take_in(self, node, self->result, size))
        continue;
    if (!add_piece(self, node, self->result, size))
        return false;
    if (++self->added[node] < self->compared[node] + self->compared[node] / 2)
        return true;
    self->compared[node] = self->added[node];
    return is_whole(self, node, FEW_SPLITS) ? note_whole(self, node) : !self->failed;
}

/* Adds the points before a step that lead to the points of a piece. */
static bool pass_on(backward *self, const piece *from, const edge *over)
{
    const fsm_bound *before = self->bounds + over->bounds;
    size_t cells = (size_t)over->size * over->size, cells_after = (size_t)over->size_after * over->size_after;
    const fsm_bound *reached = before + cells;
    uint32_t source[FSM_MOST_CLOCKS + 1];
    memcpy(self->part, self->bounds + from->bounds, cells_after * sizeof *self->part);
    memcpy(self->result, before, cells * sizeof *before);
    if (over->passes == PASS_LATER)
        fsm_zone_down(self->part, over->size_after);
    if (!fsm_zone_intersect(self->part, reached, over->size_after))
        return true;
    if (over->passes == PASS_WAIT) {
        fsm_zone_down(self->part, over->size_after);
        return !fsm_zone_intersect(self->result, self->part, over->size) || add_points(self, over->from, over->size);
    }
    for (uint32_t i = 0; i < over->size_after; i++)
        source[i] = (uint32_t)reached[cells_after + i];
    return !fsm_zone_unmap(self->result, over->size, self->part, over->size_after, source)
        || add_points(self, over->from, over->size);
}

static bool pass_all_on(backward *self)
{
    for (size_t next = 0, count = 0; self->whole_next < self->whole_count || next < self->piece_count; count++) {
        size_t number = self->whole_next < self->whole_count ? self->wholes[self->whole_next++] : next++;
        const piece from = self->pieces[number];
        self->pieces[number].done = true;
        if (!may_go_on(self, count, CHECK_EVERY))
            return false;
        if (self->model->cover == FSM_COVER_HULL && self->piece_count > MOST_PIECES)
            return fail(self);
        for (uint32_t at = from.done ? FSM_NONE : self->edges_to[from.node]; at != FSM_NONE; at = self->edges[at].next) {
            const edge over = self->edges[at];
            if (!self->whole[over.from] && !pass_on(self, &from, &over))
                return false;
        }
    }
    return true;
}

/* Passes on what becomes whole only when all its pieces are there, until all is passed on. */
static bool close_up(backward *self)
{
    bool more = true;
    while (more) {
        if (!pass_all_on(self))
            return false;
        more = false;
        for (uint32_t node = 0; node < self->model->node_count; node++)
            if (!self->whole[node] && self->pieces_of[node] != FSM_NONE && self->compared[node] != self->added[node]) {
                self->compared[node] = self->added[node];
                bool whole = is_whole(self, node, MOST_SPLITS);
                if (self->failed || (whole && !note_whole(self, node)))
                    return false;
                more = more || whole;
            }
    }
    return true;
}

/* --- steps ---------------------------------------------------------------------------------------------- */

/* The step leads to `reached`, and when time has passed, to `end`. */
static bool add_edge(backward *self, uint32_t part, const fsm_bound *before, const fsm_bound *reached, const fsm_bound *end,
                     uint32_t size, passage passes)
{
    uint32_t to = node_with(self, part, end, size);
    if (to == FSM_NONE || !FSM_HAS_ROOM(self->edges, self->edge_count, self->edge_room, 1024))
        return fail(self);
    self->edges[self->edge_count] = (edge){self->from, self->edges_to[to], self->size, size, self->bound_count, passes};
    self->edges_to[to] = (uint32_t)self->edge_count++;
    fsm_bound source[FSM_MOST_CLOCKS + 1];
    for (uint32_t i = 0; i < size; i++)
        source[i] = (fsm_bound)self->model->timed.source[i];
    if (!add_bounds(self, before, (size_t)self->size * self->size) || !add_bounds(self, reached, (size_t)size * size)
        || !add_bounds(self, source, size))
        return false;
    return !self->whole[to] || self->pieces_of[to] != FSM_NONE || note_whole(self, to);
}

static bool visit(void *context, const fsm_timed_step *step)
{
    backward *self = context;
    fsm_timed_model *m = self->model;
    fsm_timed *t = &m->timed;
    const fsm_bound *before = step->fires ? t->guarded : self->zone;
    uint32_t part = 2 * fsm_store_find(&t->tuples, step->tuple);
    bool waits, choice;
    if (!fsm_timed_may_wait(t, step->tuple, &waits) || !fsm_timed_limits(t, step->tuple, self->limits, &choice))
        return fail(self);
    fsm_timed_points at = {step->tuple, part / 2, step->size, self->limits, step->zone};
    if (!waits)
        return add_edge(self, part, before, step->zone, step->zone, step->size, PASS_AT_ONCE);
    if (fsm_timed_cut_stable(m, &at, self->part)) {
        memcpy(self->end, self->part, (size_t)step->size * step->size * sizeof *self->end);
        fsm_zone_up(self->end, step->size);
        (void)fsm_zone_below(self->end, step->size, m->upper);
        if (!add_edge(self, part + 1, before, self->part, self->end, step->size, PASS_LATER))
            return false;
    }
    fsm_timed_due next = {0};
    while (fsm_timed_cut_due(m, &at, &next, self->part))
        if (!add_edge(self, part, before, self->part, self->part, step->size, PASS_AT_ONCE))
            return false;
    return true;
}

static bool add_waiting(backward *self, uint32_t tuple, const uint32_t *locals)
{
    bool choice;
    if (!fsm_timed_limits(&self->model->timed, locals, self->limits, &choice))
        return fail(self);
    memcpy(self->end, self->zone, (size_t)self->size * self->size * sizeof *self->end);
    fsm_zone_up(self->end, self->size);
    fsm_timed_points at = {locals, tuple, self->size, self->limits, self->end};
    fsm_timed_due next = {0};
    while (fsm_timed_cut_due(self->model, &at, &next, self->part))
        if (!add_edge(self, 2 * tuple, self->zone, self->part, self->part, self->size, PASS_WAIT))
            return false;
    return true;
}

static bool add_edges_from(backward *self, uint32_t node)
{
    fsm_timed *t = &self->model->timed;
    fsm_state state = self->model->nodes[node].state;
    uint32_t locals[FSM_MOST_MACHINES + 1];
    memcpy(locals, tuple_of(self, node), t->tuples.state_size);
    self->from = node;
    self->size = read_zone(self, node, self->zone);
    return (!fsm_timed_is_stable(state) || add_waiting(self, fsm_left(state) >> 1, locals))
        && (fsm_timed_successors(t, locals, self->zone, true, visit, self) || fail(self));
}

/* --- all ------------------------------------------------------------------------------------------------ */

static bool init(backward *self)
{
    uint32_t nodes = self->model->node_count + 1;
    self->edges_to = malloc(nodes * sizeof *self->edges_to);
    self->pieces_of = malloc(nodes * sizeof *self->pieces_of);
    self->whole = calloc(nodes, 1);
    self->added = calloc(nodes, sizeof *self->added);
    self->compared = calloc(nodes, sizeof *self->compared);
    self->wholes = malloc(nodes * sizeof *self->wholes);
    self->hull = malloc(FSM_ZONE_ROOM * sizeof *self->hull);
    self->limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->limits);
    self->zone = malloc(FSM_ZONE_ROOM * sizeof *self->zone);
    self->part = malloc(FSM_ZONE_ROOM * sizeof *self->part);
    self->end = malloc(FSM_ZONE_ROOM * sizeof *self->end);
    self->result = malloc(FSM_ZONE_ROOM * sizeof *self->result);
    for (uint32_t i = 0; self->edges_to != NULL && self->pieces_of != NULL && i < nodes; i++)
        self->edges_to[i] = self->pieces_of[i] = FSM_NONE;
    return self->edges_to != NULL && self->pieces_of != NULL && self->whole != NULL && self->added != NULL
        && self->compared != NULL && self->wholes != NULL && self->hull != NULL && self->limits != NULL
        && self->zone != NULL && self->part != NULL && self->end != NULL && self->result != NULL;
}

static void free_all(backward *self)
{
    free(self->bounds);
    free(self->edges);
    free(self->pieces);
    free(self->edges_to);
    free(self->pieces_of);
    free(self->whole);
    free(self->added);
    free(self->compared);
    free(self->wholes);
    free(self->hull);
    free(self->limits);
    free(self->zone);
    free(self->part);
    free(self->end);
    free(self->result);
}

bool fsm_timed_reach_sure(fsm_timed_model *model, fsm_search *search, const unsigned char *sure, bool *all)
{
    backward self = {.model = model, .search = search};
    const fsm_set *passed = &search->passed;
    bool fine = init(&self);
    for (uint32_t node = 0; fine && node < model->node_count; node++)
        self.whole[node] = sure[fsm_set_find(passed, model->nodes[node].state)];
    for (uint32_t node = 0; fine && node < model->node_count; node++)
        if (!self.whole[node] && fsm_timed_is_maximal(model, model->nodes[node].state))
            fine = may_go_on(&self, node, CHECK_EVERY) && add_edges_from(&self, node);
    fine = fine && close_up(&self);
    *all = fine;
    for (uint32_t node = 0; *all && node < model->node_count; node++)
        *all = !fsm_timed_is_maximal(model, model->nodes[node].state) || self.whole[node];
    free_all(&self);
    return fine;
}
