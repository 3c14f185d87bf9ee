#include "slots/slot_figures.h"

#include "symbolic/natural.h"

#include <stdlib.h>

typedef struct {
    fsm_symbolic *symbolic;
    uint32_t lowest, all; /* level of the head; the terminal below it */
    fsm_hash_map known;
    bool failed;
} cutting;

/* A set of states without what is below the head. */
static uint32_t cut(cutting *self, uint32_t node)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t level = fsm_mdd_at(mdd, node)->level;
    if (level < self->lowest || self->failed)
        return self->all;
    const uint64_t *known = fsm_hash_map_find(&self->known, node);
    if (known != NULL)
        return (uint32_t)*known;
    size_t base = fsm_mdd_start(mdd);
    for (uint32_t i = 0; i < fsm_mdd_at(mdd, node)->count && !self->failed; i++) {
        fsm_mdd_pair pair = fsm_mdd_pairs(mdd, node)[i];
        self->failed = !fsm_mdd_push(mdd, pair.value, cut(self, pair.child));
    }
    uint32_t made = fsm_mdd_make(mdd, level, base);
    self->failed = self->failed || made == 0 || !fsm_hash_map_add(&self->known, node, made);
    return made;
}

/* The figures of all states together. */
static uint32_t locals_of(cutting *self, uint32_t top)
{
    fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t count, found = 0;
    uint32_t *nodes = fsm_nodes_of(mdd, self->symbolic->root, &count);
    self->failed = nodes == NULL;
    for (uint32_t i = 0; !self->failed && i < count; i++)
        if (fsm_mdd_at(mdd, nodes[i])->level == top)
            found = fsm_mdd_union(mdd, found, cut(self, nodes[i]));
    self->failed = self->failed || mdd->failed;
    free(nodes);
    return found;
}

/* The ways down from a node, each once. */
static char *count_paths(const cutting *self, uint32_t root, size_t width)
{
    const fsm_mdd *mdd = &self->symbolic->mdd;
    uint32_t count;
    uint32_t *nodes = fsm_nodes_of(mdd, root, &count);
    uint32_t *places = calloc(mdd->node_count, sizeof *places), *sums = calloc(((size_t)count + 1) * width, sizeof *sums);
    const uint32_t one = 1;
    char *text = NULL;
    for (uint32_t i = 0; nodes != NULL && places != NULL && sums != NULL && i < count; i++) {
        uint32_t *sum = sums + (i + 1) * width;
        places[nodes[i]] = i + 1;
        for (uint32_t n = 0; n < fsm_mdd_at(mdd, nodes[i])->count; n++) {
            uint32_t place = places[fsm_mdd_pairs(mdd, nodes[i])[n].child];
            if (place == 0)
                fsm_natural_add(sum, width, &one, 1, 1);
            else
                fsm_natural_add(sum, width, sums + place * width, width, 1);
        }
        if (i + 1 == count)
            text = fsm_natural_text(sum, width);
    }
    if (count == 0)
        text = fsm_natural_text(sums, width);
    free(nodes);
    free(places);
    free(sums);
    return text;
}

char *fsm_count_locals(fsm_symbolic *symbolic, uint32_t machine)
{
    uint32_t room = fsm_slots_levels(&symbolic->slots, machine), top = symbolic->level_of[machine];
    cutting self = {.symbolic = symbolic, .lowest = top - room};
    self.all = fsm_symbolic_terminal(symbolic, (fsm_waiting){0, 0, 0});
    uint32_t found = self.all == 0 ? 0 : locals_of(&self, top);
    fsm_hash_map_free(&self.known);
    return self.all == 0 || self.failed ? NULL : count_paths(&self, found, (size_t)room + 2); /* a digit for each level */
}
