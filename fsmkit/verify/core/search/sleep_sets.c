#include "search/sleep_sets.h"

#include <stdlib.h>

enum { ROW = FSM_MOST_FOOTPRINTS / 64 }; /* words */

bool fsm_sleep_sets_init(fsm_sleep_sets *self)
{
    const fsm_footprint anything = {.moved = UINT64_MAX, .receivers = UINT64_MAX};
    self->rows = calloc((size_t)FSM_MOST_FOOTPRINTS * ROW, sizeof *self->rows);
    return self->rows != NULL && fsm_store_init(&self->footprints, sizeof anything)
        && fsm_store_insert(&self->footprints, &anything, SIZE_MAX, NULL) == 0;
}

void fsm_sleep_sets_free(fsm_sleep_sets *self)
{
    fsm_store_free(&self->footprints);
    free(self->rows);
    self->rows = NULL;
}

size_t fsm_sleep_sets_bytes(const fsm_sleep_sets *self)
{
    return fsm_store_bytes(&self->footprints) + self->footprints.count * ROW * sizeof *self->rows;
}

static bool touch_the_same(const fsm_footprint *a, const fsm_footprint *b)
{
    return ((a->moved & (b->moved | b->receivers)) | (a->receivers & b->moved) | (a->inputs & b->inputs)) != 0;
}

/* Whether a step sleeps in a state that was found first by another one. */
static bool sleeps(const fsm_footprint *step, const fsm_footprint *found_by)
{
    if (step->mover >= found_by->mover || step->calls || touch_the_same(step, found_by))
        return false;
    if (step->part != found_by->part && (step->part < FSM_OWN || found_by->part < FSM_OWN))
        return false;
    if (found_by->part == FSM_OPEN)
        return !step->sends;
    return step->part != FSM_OPEN || !found_by->takes;
}

static void set_bit(fsm_sleep_sets *self, uint32_t step, uint32_t found_by)
{
    const fsm_footprint *a = fsm_store_at(&self->footprints, step), *b = fsm_store_at(&self->footprints, found_by);
    if (sleeps(a, b))
        (void)__atomic_fetch_or(&self->rows[(size_t)found_by * ROW + step / 64], UINT64_C(1) << step % 64, __ATOMIC_RELAXED);
}

uint32_t fsm_sleep_sets_number(fsm_sleep_sets *self, const fsm_footprint *footprint)
{
    uint32_t known = fsm_store_find(&self->footprints, footprint), count = self->footprints.count;
    if (known != FSM_NONE)
        return known;
    if (count == FSM_MOST_FOOTPRINTS)
        return 0;
    uint32_t number = fsm_store_insert(&self->footprints, footprint, SIZE_MAX, NULL);
    for (uint32_t other = 0; number != FSM_NONE && other < count; other++) {
        set_bit(self, number, other);
        set_bit(self, other, number);
    }
    return number;
}
