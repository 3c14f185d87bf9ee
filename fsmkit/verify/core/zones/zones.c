#include "zones/zones.h"

#include <stdlib.h>
#include <string.h>

void fsm_zone_zero(fsm_bound *zone, uint32_t size)
{
    for (uint32_t i = 0; i < size * size; i++)
        zone[i] = fsm_at_most(0);
}

bool fsm_zone_close(fsm_bound *zone, uint32_t size)
{
    for (uint32_t k = 0; k < size; k++)
        for (uint32_t i = 0; i < size; i++)
            for (uint32_t j = 0; j < size; j++) {
                fsm_bound through = fsm_bound_sum(zone[i * size + k], zone[k * size + j]);
                if (through < zone[i * size + j])
                    zone[i * size + j] = through;
            }
    for (uint32_t i = 0; i < size; i++)
        if (zone[i * size + i] < fsm_at_most(0))
            return false;
    return true;
}

void fsm_zone_up(fsm_bound *zone, uint32_t size)
{
    for (uint32_t i = 1; i < size; i++)
        zone[i * size] = FSM_UNBOUNDED;
}

void fsm_zone_down(fsm_bound *zone, uint32_t size)
{
    for (uint32_t i = 1; i < size; i++) {
        zone[i] = fsm_at_most(0);
        for (uint32_t j = 1; j < size; j++)
            zone[i] = zone[j * size + i] < zone[i] ? zone[j * size + i] : zone[i];
    }
}

bool fsm_zone_cut(fsm_bound *zone, uint32_t size, uint32_t i, uint32_t j, fsm_bound bound)
{
    const fsm_bound *from = &zone[j * size];
    if (bound >= zone[i * size + j])
        return true;
    if (fsm_bound_sum(from[i], bound) < fsm_at_most(0))
        return false;
    for (uint32_t k = 0; k < size; k++) {
        fsm_bound *row = &zone[k * size], to = fsm_bound_sum(row[i], bound);
        for (uint32_t l = 0; l < size; l++) {
            fsm_bound through = fsm_bound_sum(to, from[l]);
            row[l] = through < row[l] ? through : row[l];
        }
    }
    return true;
}

bool fsm_zone_intersect(fsm_bound *zone, const fsm_bound *other, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++)
        for (uint32_t j = 0; j < size; j++)
            if (!fsm_zone_cut(zone, size, i, j, other[i * size + j]))
                return false;
    return true;
}

/* All the new bounds are on edges to clock 0, and a shortest path takes at most one of them. */
bool fsm_zone_below(fsm_bound *zone, uint32_t size, const fsm_bound *upper)
{
    for (uint32_t i = 0; i < size; i++) {
        fsm_bound *row = &zone[i * size], least = row[0];
        for (uint32_t j = 1; j < size; j++) {
            fsm_bound through = fsm_bound_sum(row[j], upper[j]);
            least = through < least ? through : least;
        }
        if (i == 0 && least < fsm_at_most(0))
            return false;
        if (least == row[0])
            continue;
        row[0] = least;
        for (uint32_t j = 1; j < size; j++) {
            fsm_bound through = fsm_bound_sum(least, zone[j]);
            row[j] = through < row[j] ? through : row[j];
        }
    }
    return true;
}

bool fsm_zone_above(fsm_bound *zone, uint32_t size, uint32_t clock, int32_t c)
{
    fsm_bound bound = fsm_at_most(-c);
    const fsm_bound *from = &zone[clock * size];
    if (fsm_bound_sum(from[0], bound) < fsm_at_most(0))
        return false;
    if (bound >= zone[clock])
        return true;
    for (uint32_t i = 0; i < size; i++) {
        fsm_bound *row = &zone[i * size], to = fsm_bound_sum(row[0], bound);
        for (uint32_t j = 0; j < size; j++) {
            fsm_bound through = fsm_bound_sum(to, from[j]);
            row[j] = through < row[j] ? through : row[j];
        }
    }
    return true;
}

void fsm_zone_map(fsm_bound *to, uint32_t to_size, const fsm_bound *from, uint32_t from_size,
                  const uint32_t *source)
{
    for (uint32_t i = 0; i < to_size; i++) {
        const fsm_bound *row = &from[(i == 0 ? 0 : source[i]) * from_size];
        to[i * to_size] = row[0];
        for (uint32_t j = 1; j < to_size; j++)
            to[i * to_size + j] = row[source[j]];
    }
}

bool fsm_zone_unmap(fsm_bound *zone, uint32_t size, const fsm_bound *image, uint32_t image_size, const uint32_t *source)
{
    for (uint32_t i = 0; i < image_size; i++)
        for (uint32_t j = 0; j < image_size; j++) {
            uint32_t from = i == 0 ? 0 : source[i], to = j == 0 ? 0 : source[j];
            if (!fsm_zone_cut(zone, size, from, to, image[i * image_size + j]))
                return false;
        }
    return true;
}

void fsm_zone_extrapolate(fsm_bound *zone, uint32_t size, uint32_t clock, int32_t most)
{
    bool changed = false;
    for (uint32_t j = 0; j < size; j++) {
        fsm_bound *above = &zone[clock * size + j], *below = &zone[j * size + clock];
        if (j != clock && *above != FSM_UNBOUNDED && *above > fsm_at_most(most)) {
            *above = FSM_UNBOUNDED;
            changed = true;
        }
        if (j != clock && *below < fsm_less_than(-most)) {
            *below = fsm_less_than(-most);
            changed = true;
        }
    }
    if (changed)
        (void)fsm_zone_close(zone, size);
}

/* All points are beyond: where they are is one open half-line. */
static bool free_beyond(fsm_bound *zone, uint32_t size, uint32_t clock, int32_t most)
{
    if (zone[clock] >= fsm_at_most(-most))
        return false;
    for (uint32_t j = 0; j < size; j++) {
        if (j == clock)
            continue;
        zone[clock * size + j] = FSM_UNBOUNDED;
        zone[j * size + clock] = fsm_bound_sum(zone[j * size], fsm_less_than(-most));
    }
    return true;
}

void fsm_zone_forget(fsm_bound *zone, uint32_t size, const int32_t *most)
{
    bool changed = false;
    for (uint32_t i = 1; i < size; i++)
        changed = free_beyond(zone, size, i, most[i]) || changed;
    for (uint32_t i = 1; i < size; i++)
        for (uint32_t j = 0; j < size; j++) {
            fsm_bound *above = &zone[i * size + j], *below = &zone[j * size + i];
            if (j == i)
                continue;
            if (*above != FSM_UNBOUNDED && *above > fsm_at_most(most[i])) {
                *above = FSM_UNBOUNDED;
                changed = true;
            }
            if (*below < fsm_less_than(-most[i])) {
                *below = fsm_less_than(-most[i]);
                changed = true;
            }
        }
    if (changed)
        (void)fsm_zone_close(zone, size);
}

/* Whether some point of `small` is not represented, given that a larger zone allows x_i - x_j only up
 * to `tight`, less than `small` does. Theorem 34 of the paper, with differences named as here. */
static bool escapes(fsm_bound tight, fsm_bound least, uint32_t i, uint32_t j, const fsm_limits *limits)
{
    int32_t lower = i == 0 ? 0 : limits[i].lower, upper = j == 0 ? 0 : limits[j].upper;
    return lower >= 0 && least >= fsm_at_most(-upper) && fsm_bound_sum(tight, fsm_less_than(-lower)) < least;
}

bool fsm_zone_covers(const fsm_bound *big, const fsm_bound *small, uint32_t size,
                     const fsm_limits *limits)
{
    for (uint32_t i = 0; i < size; i++)
        for (uint32_t j = 0; j < size; j++)
            if (big[i * size + j] < small[i * size + j]
                && (limits == NULL || escapes(big[i * size + j], small[j], i, j, limits)))
                return false;
    return true;
}

/* --- zones kept ------------------------------------------------------------------------------- */

#define WIDE 0x80000000u
#define FITS INT16_MAX /* represents "unbounded" in 16 bits */

static fsm_bound widened(int16_t bound)
{
    return bound == FITS ? FSM_UNBOUNDED : bound;
}

enum { BLOCK = 16 };

/* Whether some bound of a block is tighter; compilers make two comparisons of it. */
static bool is_tighter(const int16_t *big, const int16_t *small)
{
    int16_t found = 0;
    for (int i = 0; i < BLOCK; i++)
        found = (int16_t)(found | (big[i] < small[i] ? -1 : 0));
    return found != 0;
}

/* The same as fsm_zone_covers on 16 bits, in blocks. */
static bool covers_packed(const int16_t *big, const int16_t *small, uint32_t size, const fsm_limits *limits)
{
    uint32_t cells = size * size;
    for (uint32_t block = 0; block < cells; block += BLOCK) {
        uint32_t end = block + BLOCK < cells ? block + BLOCK : cells;
        if (end == block + BLOCK && !is_tighter(&big[block], &small[block]))
            continue;
        for (uint32_t at = block; at < end; at++)
            if (big[at] < small[at]
                && (limits == NULL || escapes(widened(big[at]), widened(small[at % size]), at / size, at % size, limits)))
                return false;
    }
    return true;
}

bool fsm_zones_init(fsm_zones *self)
{
    *self = (fsm_zones){0};
    self->packed = malloc(FSM_ZONE_ROOM * sizeof *self->packed);
    return self->packed != NULL;
}

void fsm_zones_free(fsm_zones *self)
{
    for (uint32_t clocks = 0; clocks <= FSM_MOST_CLOCKS; clocks++)
        if (self->made[clocks]) {
            fsm_store_free(&self->narrow[clocks]);
            fsm_store_free(&self->wide[clocks]);
        }
    free(self->packed);
    *self = (fsm_zones){0};
}

static bool make_stores(fsm_zones *self, uint32_t size)
{
    size_t cells = (size_t)size * size;
    if (self->made[size - 1])
        return true;
    if (!fsm_store_init(&self->narrow[size - 1], cells * sizeof(int16_t)))
        return false;
    if (!fsm_store_init(&self->wide[size - 1], cells * sizeof(fsm_bound))) {
        fsm_store_free(&self->narrow[size - 1]);
        return false;
    }
    self->bytes += fsm_store_bytes(&self->narrow[size - 1]) + fsm_store_bytes(&self->wide[size - 1]);
    return self->made[size - 1] = true;
}

bool fsm_zones_hold(fsm_zones *self, const fsm_bound *zone, uint32_t size)
{
    if (!make_stores(self, size))
        return false;
    self->held = zone;
    self->size = size;
    self->fits = true;
    for (uint32_t i = 0; i < size * size; i++) {
        self->packed[i] = zone[i] >= FITS ? FITS : (int16_t)zone[i];
        self->fits &= zone[i] == FSM_UNBOUNDED || (zone[i] < FITS && zone[i] > -FITS);
    }
    return true;
}

uint32_t fsm_zones_keep(fsm_zones *self, size_t limit)
{
    fsm_store *store = self->fits ? &self->narrow[self->size - 1] : &self->wide[self->size - 1];
    size_t others = self->bytes - fsm_store_bytes(store);
    const void *bytes = self->fits ? (const void *)self->packed : (const void *)self->held;
    uint32_t number = fsm_store_insert(store, bytes, limit > others ? limit - others : 0, NULL);
    self->bytes = others + fsm_store_bytes(store);
    return number == FSM_NONE || self->fits ? number : number | WIDE;
}

uint32_t fsm_zones_find(const fsm_zones *self)
{
    const fsm_store *store = self->fits ? &self->narrow[self->size - 1] : &self->wide[self->size - 1];
    uint32_t number = fsm_store_find(store, self->fits ? (const void *)self->packed : (const void *)self->held);
    return number == FSM_NONE || self->fits ? number : number | WIDE;
}

static uint64_t clamped(int64_t sum)
{
    const int64_t zero = 1 << 14;
    return sum < -zero ? 0 : sum >= zero ? 2 * (uint64_t)zero - 1 : (uint64_t)(sum + zero);
}

/* The bounds of a clock without a choice are plain, since it never passes the one constant that it is
 * compared with: there `escapes` is always true. That holds for clock 0, too. Beside a clock that is compared with
 * no upper limit it never is. */
fsm_zone_summary fsm_zones_summary(const fsm_zones *self, const fsm_limits *limits)
{
    fsm_zone_summary found = {0, 0};
    int64_t sums[4] = {0, 0, 0, 0};
    uint32_t at = 0;
    for (uint32_t i = 0; i < self->size; i++) {
        if (i > 0 && limits != NULL && limits[i].lower != limits[i].upper)
            continue;
        const fsm_bound *row = &self->held[i * self->size];
        for (uint32_t j = 0; j < self->size; j++) {
            if (limits != NULL && limits[j].upper == FSM_NEVER)
                continue;
            sums[i & 3] += row[j] == FSM_UNBOUNDED ? 1 << 16 : row[j];
            if (i > 0 && j > 0 && i != j)
                found.order |= (uint64_t)(row[j] > fsm_at_most(0)) << (at++ & 63);
        }
    }
    for (int lane = 0; lane < 4; lane++)
        found.sums |= clamped(sums[lane]) << (16 * lane);
    return found;
}

bool fsm_zones_covers(const fsm_zones *self, uint32_t number, const fsm_limits *limits)
{
    if (self->fits && (number & WIDE) == 0)
        return covers_packed(fsm_store_at(&self->narrow[self->size - 1], number), self->packed, self->size, limits);
    fsm_bound zone[FSM_ZONE_ROOM];
    fsm_zones_read(self, number, self->size, zone);
    return fsm_zone_covers(zone, self->held, self->size, limits);
}

bool fsm_zones_is_covered(const fsm_zones *self, uint32_t number, const fsm_limits *limits)
{
    if (self->fits && (number & WIDE) == 0)
        return covers_packed(self->packed, fsm_store_at(&self->narrow[self->size - 1], number), self->size, limits);
    fsm_bound zone[FSM_ZONE_ROOM];
    fsm_zones_read(self, number, self->size, zone);
    return fsm_zone_covers(self->held, zone, self->size, limits);
}

void fsm_zones_read(const fsm_zones *self, uint32_t number, uint32_t size, fsm_bound *zone)
{
    if (number & WIDE) {
        memcpy(zone, fsm_store_at(&self->wide[size - 1], number & ~WIDE), (size_t)size * size * sizeof *zone);
        return;
    }
    const int16_t *packed = fsm_store_at(&self->narrow[size - 1], number);
    for (uint32_t i = 0; i < size * size; i++)
        zone[i] = widened(packed[i]);
}
