/* zones.h: sets of clock values given by bounds on clocks and on their differences (difference bound
 * matrices: Dill 1989; Bengtsson and Yi 2004).
 *
 * A zone over n clocks is a square matrix of `size` n + 1, row by row; entry (i, j) bounds x_i - x_j,
 * and x_0 is always 0. All functions but `fsm_zone_close` expect and leave the matrix closed (each
 * bound is the least that follows from the others) and not empty; where a zone may become empty, the
 * function says so and the matrix is of no use any more. */
#ifndef FSM_ZONES_H
#define FSM_ZONES_H

#include "store/store.h"

#include <stdbool.h>
#include <stdint.h>

/* "at most c" is 2c + 1, "less than c" is 2c: a smaller number is a tighter bound. */
typedef int32_t fsm_bound;

#define FSM_UNBOUNDED INT32_MAX

enum {
    FSM_MOST_CLOCKS = 128,
    FSM_LONGEST = 1 << 28, /* bounds c are below that, so that sums do not overflow */
    FSM_ZONE_ROOM = (FSM_MOST_CLOCKS + 1) * (FSM_MOST_CLOCKS + 1)
};

static inline fsm_bound fsm_at_most(int32_t c)
{
    return 2 * c + 1;
}

static inline fsm_bound fsm_less_than(int32_t c)
{
    return 2 * c;
}

static inline fsm_bound fsm_bound_sum(fsm_bound a, fsm_bound b)
{
    return a == FSM_UNBOUNDED || b == FSM_UNBOUNDED ? FSM_UNBOUNDED : a + b - ((a | b) & 1);
}

/* The constants a clock is compared with: whether it is at least `lower` (negative: it always is),
 * whether it is at most `upper`. Beyond them its value makes no difference (Behrmann et al. 2006). */
typedef struct {
    int32_t lower, upper;
} fsm_limits;

enum {
    FSM_OPEN_ENDED = 1 << 30, /* ticks from the least to the greatest duration of a timer that has no end */
    FSM_NEVER = -2            /* the upper limit of its clock */
};

/* Sets all clocks to 0. */
void fsm_zone_zero(fsm_bound *zone, uint32_t size);

/* Tightens all bounds by one another (Floyd, Warshall); false if the zone is empty. */
bool fsm_zone_close(fsm_bound *zone, uint32_t size);

/* Any time passes. */
void fsm_zone_up(fsm_bound *zone, uint32_t size);

/* Any time has still to pass: all points from which time leads into the zone. */
void fsm_zone_down(fsm_bound *zone, uint32_t size);

/* Only where x_i - x_j is below a bound; false if nothing is left. */
bool fsm_zone_cut(fsm_bound *zone, uint32_t size, uint32_t i, uint32_t j, fsm_bound bound);

/* Intersects with another zone; false if the result is empty. */
bool fsm_zone_intersect(fsm_bound *zone, const fsm_bound *other, uint32_t size);

/* Restricts each clock i to the upper bound `upper[i]` (that of clock 0 is not read). */
bool fsm_zone_below(fsm_bound *zone, uint32_t size, const fsm_bound *upper);

/* Only where a clock is at least `c`. */
bool fsm_zone_above(fsm_bound *zone, uint32_t size, uint32_t clock, int32_t c);

/* Clock i of the new zone is clock `source[i]` of the old one; `source[i]` 0 creates a clock that is 0.
 * One call thus resets, reorders, removes and creates clocks. */
void fsm_zone_map(fsm_bound *to, uint32_t to_size, const fsm_bound *from, uint32_t from_size,
                  const uint32_t *source);

/* Only the points of a zone that fsm_zone_map maps into `image`, a zone over the clocks that `source` describes; false if
 * nothing is left. */
bool fsm_zone_unmap(fsm_bound *zone, uint32_t size, const fsm_bound *image, uint32_t image_size, const uint32_t *source);

/* Forgets how far a clock is beyond `most`; closed afterwards. */
void fsm_zone_extrapolate(fsm_bound *zone, uint32_t size, uint32_t clock, int32_t most);

/* Forgets how far each clock is beyond most[i], at once for all: one by one they would restore each other. Added
 * points cannot be distinguished by comparing single clocks with constants up to these (Extra_M, and of a clock that is
 * beyond in all points every difference: Behrmann et al. 2006); closed afterwards. */
void fsm_zone_forget(fsm_bound *zone, uint32_t size, const int32_t *most);

/* Whether each point of `small` does nothing that a point of `big` cannot do at the same times, as far
 * as clocks are compared with `limits` only: abstraction aLU of Herbreteau, Srivathsan and Walukiewicz
 * (2012). Without `limits`: whether it is a subset. */
bool fsm_zone_covers(const fsm_bound *big, const fsm_bound *small, uint32_t size,
                     const fsm_limits *limits);

/* --- zones kept ------------------------------------------------------------------------------------
 * Equal zones are kept once, in 16 bits a bound where they fit. */

typedef struct {
    fsm_store narrow[FSM_MOST_CLOCKS + 1], wide[FSM_MOST_CLOCKS + 1]; /* by the number of clocks */
    bool made[FSM_MOST_CLOCKS + 1];
    size_t bytes;
    const fsm_bound *held; /* the current zone, and the same in 16 bits a bound if it fits */
    uint32_t size;
    bool fits;
    int16_t *packed;
} fsm_zones;

bool fsm_zones_init(fsm_zones *self);
void fsm_zones_free(fsm_zones *self);

/* Takes a zone in hand; it must stay where it is. False if memory ran out. */
bool fsm_zones_hold(fsm_zones *self, const fsm_bound *zone, uint32_t size);

/* The number of the zone in hand among those of its size, which is kept if it is new; FSM_NONE if
 * memory ran out or all would take more than `limit` bytes. */
uint32_t fsm_zones_keep(fsm_zones *self, size_t limit);

/* The number of the zone in hand if it is kept; FSM_NONE else. */
uint32_t fsm_zones_find(const fsm_zones *self);

/* A summary of a zone, by which most that do not cover each other are distinguished: a bit for each pair of
 * clocks, whether the first may be greater; and four sums of bounds. Only of clocks whose two limits are
 * the same (of all, if `limits` is NULL), and only for zones in which no clock passes its upper limit. */
typedef struct {
    uint64_t order, sums;
} fsm_zone_summary;

/* The summary of the zone in hand. */
fsm_zone_summary fsm_zones_summary(const fsm_zones *self, const fsm_limits *limits);

/* Whether a zone may cover another one. */
static inline bool fsm_may_cover(fsm_zone_summary big, fsm_zone_summary small)
{
    const uint64_t high = 0x8000800080008000u; /* above each of the sums, of 15 bits */
    return (small.order & ~big.order) == 0 && (((big.sums | high) - small.sums) & high) == high;
}

/* Whether a kept zone covers the one in hand, and the other way round; see `fsm_zone_covers`. */
bool fsm_zones_covers(const fsm_zones *self, uint32_t number, const fsm_limits *limits);
bool fsm_zones_is_covered(const fsm_zones *self, uint32_t number, const fsm_limits *limits);

/* Writes a kept zone out. */
void fsm_zones_read(const fsm_zones *self, uint32_t number, uint32_t size, fsm_bound *zone);

#endif
