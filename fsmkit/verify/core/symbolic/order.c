#include "symbolic/order.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_STARTS = 200,
    MOST_ROUNDS = 60,
    MAX_WAIT = 8,        /* rounds without a better order before a start is given up */
    WORK = 20 << 20,     /* ends of wires looked at, about, in all starts */
    FEW_MACHINES = 96,   /* for which all exchanges of two are tried */
    MANY_MACHINES = 2048 /* from which on only the order of the file is improved */
};

/* A machine and all receivers of one of its messages: ends from one index on. */
typedef struct {
    uint32_t first, count;
    double weight;
} edge;

typedef struct {
    const fsm_system *system;
    edge *edges;
    uint32_t *ends, edge_count, end_count;
    uint32_t *place, *next, *best; /* by machine */
    double *pull, *weight;
    uint64_t random;
} ordering;

/* --- wires ----------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t from; /* machine and what leaves it */
    uint32_t target;
} wire;

static int by_start(const void *a, const void *b)
{
    const wire *x = a, *y = b;
    return x->from != y->from ? (x->from > y->from) - (x->from < y->from) : (x->target > y->target) - (x->target < y->target);
}

static void add_edge(ordering *self, const wire *wires, uint32_t count)
{
    edge *added = &self->edges[self->edge_count++];
    *added = (edge){.first = self->end_count};
    self->ends[self->end_count++] = (uint32_t)(wires[0].from >> 32);
    for (uint32_t i = 0; i < count; i++)
        if (i == 0 || wires[i].target != wires[i - 1].target)
            self->ends[self->end_count++] = wires[i].target;
    added->count = self->end_count - added->first;
    added->weight = added->count > 1 ? 1.0 / (added->count - 1) : 0;
}

/* A message to several machines counts once. */
static bool find_edges(ordering *self)
{
    const fsm_system *system = self->system;
    uint32_t count = 0, all = system->event_link_count + system->input_link_count;
    wire *wires = malloc((all + 1u) * sizeof *wires);
    self->edges = malloc((all + 1u) * sizeof *self->edges);
    self->ends = malloc((2u * all + 1u) * sizeof *self->ends);
    bool fine = wires != NULL && self->edges != NULL && self->ends != NULL;
    for (uint32_t i = 0; fine && i < system->event_link_count; i++) {
        const fsm_event_link *link = &system->event_links[i];
        wires[count++] = (wire){(uint64_t)link->source << 32 | link->port << 1, link->target};
    }
    for (uint32_t i = 0; fine && i < system->input_link_count; i++) {
        const fsm_input_link *link = &system->input_links[i];
        wires[count++] = (wire){(uint64_t)link->source << 32 | link->output << 1 | 1, link->target};
    }
    if (fine)
        qsort(wires, count, sizeof *wires, by_start);
    for (uint32_t first = 0, end; first < count; first = end) {
        for (end = first; end < count && wires[end].from == wires[first].from; end++)
            ;
        add_edge(self, wires + first, end - first);
    }
    free(wires);
    return fine;
}

static double cost_of(const ordering *self, const uint32_t *place)
{
    double cost = 0;
    for (uint32_t e = 0; e < self->edge_count; e++) {
        const uint32_t *ends = self->ends + self->edges[e].first;
        uint32_t least = place[ends[0]], most = least;
        for (uint32_t i = 1; i < self->edges[e].count; i++) {
            least = place[ends[i]] < least ? place[ends[i]] : least;
            most = place[ends[i]] > most ? place[ends[i]] : most;
        }
        cost += (most - least) * self->edges[e].weight;
    }
    return cost;
}

/* --- one start --------------------------------------------------------------------------------------- */

/* Numerical Recipes' generator; the high bits are good enough. */
static uint32_t random_below(ordering *self, uint32_t count)
{
    self->random = self->random * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((self->random >> 33) % count);
}

typedef struct {
    double pull;
    uint32_t machine;
} pulled;

static int by_pull(const void *a, const void *b)
{
    const pulled *x = a, *y = b;
    return x->pull != y->pull ? (x->pull > y->pull) - (x->pull < y->pull) : (x->machine > y->machine) - (x->machine < y->machine);
}

/* Each machine goes where the middles of its wires are. */
static void move_all(ordering *self, pulled *sorted)
{
    uint32_t count = self->system->machine_count;
    memset(self->pull, 0, count * sizeof *self->pull);
    memset(self->weight, 0, count * sizeof *self->weight);
    for (uint32_t e = 0; e < self->edge_count; e++) {
        const edge *at = &self->edges[e];
        double middle = 0;
        for (uint32_t i = 0; i < at->count; i++)
            middle += self->place[self->ends[at->first + i]];
        for (uint32_t i = 0; i < at->count; i++) {
            self->pull[self->ends[at->first + i]] += middle / at->count * at->weight;
            self->weight[self->ends[at->first + i]] += at->weight;
        }
    }
    for (uint32_t i = 0; i < count; i++)
        sorted[i] = (pulled){self->weight[i] > 0 ? self->pull[i] / self->weight[i] : self->place[i], i};
    qsort(sorted, count, sizeof *sorted, by_pull);
    for (uint32_t i = 0; i < count; i++)
        self->place[sorted[i].machine] = i;
}

/* Exchanges two machines as long as that improves the order. */
static double exchange(ordering *self, uint32_t *place, double cost)
{
    uint32_t count = self->system->machine_count;
    for (bool changed = count <= FEW_MACHINES; changed;) {
        changed = false;
        for (uint32_t a = 0; a < count; a++)
            for (uint32_t b = a + 1; b < count; b++) {
                uint32_t held = place[a];
                place[a] = place[b];
                place[b] = held;
                double now = cost_of(self, place);
                if (now < cost - 1e-9) {
                    cost = now;
                    changed = true;
                } else {
                    place[b] = place[a];
                    place[a] = held;
                }
            }
    }
    return cost;
}

/* The best order on the way from the places that are given; it is in `best`. */
static double force(ordering *self, pulled *sorted)
{
    size_t bytes = self->system->machine_count * sizeof *self->place;
    double best = cost_of(self, self->place);
    memcpy(self->best, self->place, bytes);
    for (uint32_t round = 0, since = 0; round < MOST_ROUNDS && since < MAX_WAIT; round++, since++) {
        move_all(self, sorted);
        double cost = cost_of(self, self->place);
        if (cost < best - 1e-9) {
            best = cost;
            since = 0;
            memcpy(self->best, self->place, bytes);
        }
    }
    return best;
}

/* --- the best of many ----------------------------------------------------------------------------------- */

static void keep(const ordering *self, double cost, fsm_order *orders, uint32_t *count, uint32_t most)
{
    uint32_t machines = self->system->machine_count, at = *count;
    size_t bytes = machines * sizeof *self->next;
    for (uint32_t i = 0; i < machines; i++)
        self->next[self->best[i]] = i;
    for (uint32_t i = 0; i < *count; i++)
        if (memcmp(orders[i].machines, self->next, bytes) == 0)
            return;
    while (at > 0 && orders[at - 1].cost > cost)
        at--;
    if (at == most)
        return;
    uint32_t *machines_kept = *count < most ? malloc(bytes) : orders[most - 1].machines;
    if (machines_kept == NULL)
        return;
    *count += *count < most;
    memmove(orders + at + 1, orders + at, (*count - 1 - at) * sizeof *orders);
    memcpy(machines_kept, self->next, bytes);
    orders[at] = (fsm_order){machines_kept, cost};
}

static void find_all(ordering *self, pulled *sorted, fsm_order *orders, uint32_t *count, uint32_t most)
{
    uint32_t machines = self->system->machine_count;
    uint64_t each = (uint64_t)MOST_ROUNDS * (3u * self->end_count + 20u * machines) + 1;
    uint32_t starts = each * MOST_STARTS > (uint64_t)WORK * 4 ? (uint32_t)((uint64_t)WORK * 4 / each) + 1 : MOST_STARTS;
    if (machines > MANY_MACHINES)
        starts = 1;
    for (uint32_t start = 0; start < starts; start++) {
        for (uint32_t i = 0; i < machines; i++)
            self->place[i] = i;
        for (uint32_t i = start == 0 ? 0 : machines; i > 1; i--) { /* the first one is that of the file */
            uint32_t other = random_below(self, i), held = self->place[i - 1];
            self->place[i - 1] = self->place[other];
            self->place[other] = held;
        }
        keep(self, force(self, sorted), orders, count, most);
    }
}

static void improve(ordering *self, fsm_order *orders, uint32_t *count, uint32_t most)
{
    uint32_t machines = self->system->machine_count, before = *count;
    fsm_order *old = malloc(before * sizeof *old);
    if (old == NULL || machines > FEW_MACHINES) {
        free(old);
        return;
    }
    memcpy(old, orders, before * sizeof *old);
    *count = 0;
    for (uint32_t n = 0; n < before; n++) {
        for (uint32_t i = 0; i < machines; i++)
            self->best[old[n].machines[i]] = i;
        double cost = exchange(self, self->best, old[n].cost);
        keep(self, cost, orders, count, most);
    }
    fsm_free_orders(old, before);
    free(old);
}

uint32_t fsm_find_orders(const fsm_system *system, fsm_order *orders, uint32_t most)
{
    uint32_t machines = system->machine_count, count = 0;
    ordering self = {.system = system, .random = 1};
    pulled *sorted = malloc(machines * sizeof *sorted);
    uint32_t **places[] = {&self.place, &self.next, &self.best};
    bool fine = sorted != NULL;
    for (int i = 0; i < 3; i++) {
        *places[i] = malloc(machines * sizeof **places[i]);
        fine = fine && *places[i] != NULL;
    }
    self.pull = malloc(machines * sizeof *self.pull);
    self.weight = malloc(machines * sizeof *self.weight);
    if (fine && self.pull != NULL && self.weight != NULL && find_edges(&self)) {
        find_all(&self, sorted, orders, &count, most);
        improve(&self, orders, &count, most);
    }
    free(sorted);
    for (int i = 0; i < 3; i++)
        free(*places[i]);
    free(self.pull);
    free(self.weight);
    free(self.edges);
    free(self.ends);
    return count;
}

void fsm_free_orders(fsm_order *orders, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        free(orders[i].machines);
}
