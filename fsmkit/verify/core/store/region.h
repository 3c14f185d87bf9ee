/* region.h: memory that grows in place. A region reserves addresses; only touched pages use memory. */
#ifndef FSM_REGION_H
#define FSM_REGION_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    void *base; /* all zero where nothing was written */
    size_t reserved;
} fsm_region;

/* Reserves room for `bytes`, or for as much of it as can be had. False if it is missing. */
bool fsm_region_reserve(fsm_region *self, size_t bytes);
void fsm_region_release(fsm_region *self);

/* Requests large pages for randomly accessed memory, which reduces TLB misses. Small regions are left
 * unchanged. */
void fsm_region_advise(void *memory, size_t bytes);

#endif
