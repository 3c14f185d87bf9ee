/* zones_test: the operations of zones.c on random zones of two or three clocks, each compared with its
 * definition on points of a grid. Constants are whole, so zones are unions of regions, and with up to
 * three clocks each region holds a point of which all values are quarters; what is only said to exist
 * may need eighths, and two values that are free sixteenths. Prints how many rounds were tried. */
#include "zones/zones.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ONE = 16, MOST = 4, GRID = 4 }; /* sixteenths; the largest constant; a quarter */

static uint64_t seed;

static uint32_t pick(uint32_t n)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(seed >> 33) % n;
}

static bool within(int32_t difference, fsm_bound bound)
{
    if (bound == FSM_UNBOUNDED)
        return true;
    int32_t c = (bound >> 1) * ONE; /* rounds down, as it should */
    return (bound & 1) ? difference <= c : difference < c;
}

static bool holds(const fsm_bound *zone, uint32_t size, const int32_t *point)
{
    for (uint32_t i = 0; i < size; i++)
        for (uint32_t j = 0; j < size; j++)
            if (!within(point[i] - point[j], zone[i * size + j]))
                return false;
    return true;
}

static void random_zone(fsm_bound *zone, uint32_t size)
{
    do {
        for (uint32_t i = 0; i < size; i++)
            for (uint32_t j = 0; j < size; j++)
                zone[i * size + j] = i == j ? fsm_at_most(0)
                    : i == 0                ? fsm_at_most(0) - (fsm_bound)pick(2 * MOST)
                    : pick(3) == 0          ? FSM_UNBOUNDED
                                            : fsm_less_than(-MOST) + (fsm_bound)pick(4 * MOST);
    } while (!fsm_zone_close(zone, size));
}

/* Goes to the next point of the grid. */
static bool next(int32_t *point, uint32_t size)
{
    for (uint32_t i = 1; i < size; i++) {
        point[i] += GRID;
        if (point[i] <= (MOST + 1) * ONE)
            return true;
        point[i] = 0;
    }
    return false;
}

static void expect(bool fine, const char *what)
{
    if (fine)
        return;
    printf("wrong: %s\n", what);
    exit(1);
}

static bool reached_by_time(const fsm_bound *zone, uint32_t size, const int32_t *point)
{
    for (int32_t back = 0; back <= (MOST + 1) * ONE; back += GRID / 2) {
        int32_t before[4] = {0};
        bool fine = true;
        for (uint32_t i = 1; i < size; i++) {
            before[i] = point[i] - back;
            fine = fine && before[i] >= 0;
        }
        if (fine && holds(zone, size, before))
            return true;
    }
    return false;
}

static void check_time_and_bounds(const fsm_bound *zone, uint32_t size)
{
    fsm_bound later[16], below[16], above[16], upper[4] = {0};
    uint32_t clock = 1 + pick(size - 1);
    int32_t least = (int32_t)pick(MOST + 1), point[4] = {0};
    size_t bytes = (size_t)size * size * sizeof *zone;
    for (uint32_t i = 1; i < size; i++)
        upper[i] = pick(3) == 0 ? FSM_UNBOUNDED : 1 + (fsm_bound)pick(2 * MOST);
    memcpy(later, zone, bytes);
    memcpy(below, zone, bytes);
    memcpy(above, zone, bytes);
    fsm_zone_up(later, size);
    bool some_below = fsm_zone_below(below, size, upper), some_above = fsm_zone_above(above, size, clock, least);
    bool seen_below = false, seen_above = false;
    do {
        bool inside = holds(zone, size, point), under = inside, over = inside && point[clock] >= least * ONE;
        for (uint32_t i = 1; i < size; i++)
            under = under && within(point[i], upper[i]);
        expect(holds(later, size, point) == reached_by_time(zone, size, point), "up");
        expect((some_below && holds(below, size, point)) == under, "below");
        expect((some_above && holds(above, size, point)) == over, "above");
        seen_below = seen_below || under;
        seen_above = seen_above || over;
    } while (next(point, size));
    if (some_below) {
        memcpy(later, below, bytes);
        expect(fsm_zone_close(later, size) && memcmp(later, below, bytes) == 0, "closed below");
    }
    if (some_above) {
        memcpy(later, above, bytes);
        expect(fsm_zone_close(later, size) && memcmp(later, above, bytes) == 0, "closed above");
    }
    expect((some_below || !seen_below) && (some_above || !seen_above), "not empty");
}

static bool leads_there(const fsm_bound *zone, uint32_t size, const int32_t *point)
{
    for (int32_t later = 0; later <= (3 * MOST + 2) * ONE; later += GRID / 2) {
        int32_t after[4] = {0};
        for (uint32_t i = 1; i < size; i++)
            after[i] = point[i] + later;
        if (holds(zone, size, after))
            return true;
    }
    return false;
}

static void expect_closed(const fsm_bound *zone, uint32_t size, const char *what)
{
    fsm_bound again[16];
    memcpy(again, zone, (size_t)size * size * sizeof *zone);
    expect(fsm_zone_close(again, size) && memcmp(again, zone, (size_t)size * size * sizeof *zone) == 0, what);
}

/* The past of a zone, the intersection of two zones, and the preimage of a zone under a map. */
static void check_back(const fsm_bound *zone, uint32_t size)
{
    fsm_bound before[16], both[16], mapped[16], other[16], image[9];
    int32_t point[4] = {0};
    uint32_t source[3] = {0, pick(size), pick(size)};
    size_t bytes = (size_t)size * size * sizeof *zone;
    bool seen_both = false, seen_mapped = false;
    random_zone(other, size);
    random_zone(image, 3);
    memcpy(before, zone, bytes);
    memcpy(both, zone, bytes);
    memcpy(mapped, zone, bytes);
    fsm_zone_down(before, size);
    bool some_both = fsm_zone_intersect(both, other, size);
    bool some_mapped = fsm_zone_unmap(mapped, size, image, 3, source);
    do {
        const int32_t after[3] = {0, point[source[1]], point[source[2]]};
        bool inside = holds(zone, size, point);
        bool in_both = inside && holds(other, size, point), maps = inside && holds(image, 3, after);
        expect(holds(before, size, point) == leads_there(zone, size, point), "down");
        expect((some_both && holds(both, size, point)) == in_both, "intersect");
        expect((some_mapped && holds(mapped, size, point)) == maps, "unmap");
        seen_both = seen_both || in_both;
        seen_mapped = seen_mapped || maps;
    } while (next(point, size));
    expect((some_both || !seen_both) && (some_mapped || !seen_mapped), "not empty");
    expect_closed(before, size, "closed down");
    if (some_both)
        expect_closed(both, size, "closed intersection");
    if (some_mapped)
        expect_closed(mapped, size, "closed before a map");
}

/* Two clocks of three change places and one is forgotten; one that is 0 may be new. */
static void check_map(const fsm_bound *zone)
{
    fsm_bound mapped[9];
    uint32_t source[3] = {0, 2, pick(2)};
    int32_t point[4] = {0};
    fsm_zone_map(mapped, 3, zone, 4, source);
    do {
        bool found = false;
        if (source[2] == 0 && point[2] != 0) {
            expect(!holds(mapped, 3, point), "map to 0");
            continue;
        }
        for (int32_t forgotten = 0; !found && forgotten <= (3 * MOST + 2) * ONE; forgotten++) {
            int32_t old[4] = {0, source[2] == 1 ? point[2] : forgotten, point[1], 0};
            for (old[3] = 0; !found && old[3] <= (3 * MOST + 2) * ONE; old[3]++)
                found = holds(zone, 4, old);
        }
        expect(holds(mapped, 3, point) == found, "map");
    } while (next(point, 3));
}

/* Return whether some point of the zone satisfies the same limits as `point` at all times. */
static bool has_equivalent(const fsm_bound *zone, const int32_t *point, const fsm_limits *limits)
{
    int32_t other[4] = {0};
    for (other[1] = 0; other[1] <= (2 * MOST + 3) * ONE; other[1]++)
        for (other[2] = 0; other[2] <= (2 * MOST + 3) * ONE; other[2]++) {
            bool fine = true;
            for (uint32_t i = 1; i < 3; i++)
                fine = fine && (other[i] >= point[i] || other[i] > limits[i].lower * ONE)
                    && (other[i] <= point[i] || point[i] > limits[i].upper * ONE);
            if (fine && holds(zone, 3, other))
                return true;
        }
    return false;
}

static void check_cover(void)
{
    fsm_bound big[9], small[9];
    fsm_limits limits[3] = {{0, 0}};
    const fsm_bound upper[3] = {0, fsm_at_most(MOST + 1), fsm_at_most(MOST + 1)}; /* all of it on the grid */
    random_zone(big, 3);
    do
        random_zone(small, 3);
    while (!fsm_zone_below(small, 3, upper));
    for (uint32_t i = 1; i < 3; i++)
        limits[i] = (fsm_limits){(int32_t)pick(MOST + 1) - 1, (int32_t)pick(MOST)};
    bool subset = true, covered = true;
    int32_t point[4] = {0};
    do {
        bool inside = holds(small, 3, point);
        subset = subset && (!inside || holds(big, 3, point));
        covered = covered && (!inside || has_equivalent(big, point, limits));
    } while (covered && next(point, 3));
    expect(fsm_zone_covers(big, small, 3, limits) == covered, "covers");
    while (subset && next(point, 3))
        subset = !holds(small, 3, point) || holds(big, 3, point);
    expect(subset || !fsm_zone_covers(big, small, 3, NULL), "subset");
    fsm_zones kept;
    expect(fsm_zones_init(&kept) && fsm_zones_hold(&kept, big, 3), "init");
    uint32_t first = fsm_zones_keep(&kept, 1 << 20);
    expect(first == fsm_zones_keep(&kept, 1 << 20), "keep");
    expect(fsm_zones_hold(&kept, small, 3), "hold");
    expect(fsm_zones_covers(&kept, first, limits) == covered, "kept covers");
    expect(fsm_zones_is_covered(&kept, first, NULL) == fsm_zone_covers(small, big, 3, NULL), "is covered");
    limits[1] = (fsm_limits){MOST + 1, MOST + 1}; /* none is passed, as summaries demand it */
    limits[2].upper = MOST + 1;
    fsm_zone_summary of_small = fsm_zones_summary(&kept, limits);
    bool plain = fsm_zone_covers(big, small, 3, limits);
    expect(fsm_zones_hold(&kept, big, 3), "hold");
    expect(!plain || fsm_may_cover(fsm_zones_summary(&kept, limits), of_small), "summary");
    expect(fsm_zones_find(&kept) == first, "find");
    fsm_bound again[9];
    fsm_zones_read(&kept, first, 3, again);
    expect(memcmp(again, big, sizeof again) == 0, "read");
    big[3] = fsm_at_most(70000); /* too large for 16 bits */
    big[6] = fsm_at_most(70000);
    if (fsm_zone_close(big, 3)) {
        expect(fsm_zones_hold(&kept, big, 3), "hold");
        uint32_t wide = fsm_zones_keep(&kept, 1 << 20);
        fsm_zones_read(&kept, wide, 3, again);
        expect(memcmp(again, big, sizeof again) == 0, "read wide");
        expect(fsm_zones_hold(&kept, small, 3), "hold");
        expect(fsm_zones_covers(&kept, wide, NULL) == fsm_zone_covers(big, small, 3, NULL), "wide covers");
    }
    fsm_zones_free(&kept);
}

/* Points up to the constant stay, those beyond lose only how far they are. */
static void check_extrapolation(const fsm_bound *zone)
{
    fsm_bound wider[9];
    int32_t point[4] = {0}, most = (int32_t)pick(MOST);
    memcpy(wider, zone, sizeof wider);
    fsm_zone_extrapolate(wider, 3, 1, most);
    expect(fsm_zone_covers(wider, zone, 3, NULL), "extrapolation covers");
    do
        if (point[1] <= most * ONE)
            expect(holds(wider, 3, point) == holds(zone, 3, point), "extrapolation keeps");
    while (next(point, 3));
}

/* Points added by widening all clocks at once have an equivalent in the old zone, both ways. */
static void check_forgetting(const fsm_bound *zone)
{
    fsm_bound wider[9], again[9];
    int32_t point[4] = {0}, most[3] = {0, (int32_t)pick(MOST), (int32_t)pick(MOST)};
    const fsm_limits limits[3] = {{0, 0}, {most[1], most[1]}, {most[2], most[2]}};
    memcpy(wider, zone, sizeof wider);
    fsm_zone_forget(wider, 3, most);
    memcpy(again, wider, sizeof again);
    expect(fsm_zone_close(again, 3) && memcmp(again, wider, sizeof again) == 0, "closed after forgetting");
    expect(fsm_zone_covers(wider, zone, 3, NULL), "forgetting covers");
    do
        expect(!holds(wider, 3, point) || has_equivalent(zone, point, limits), "forgetting adds nothing new");
    while (next(point, 3));
}

int main(int argc, char **argv)
{
    uint32_t rounds = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 10;
    seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    for (uint32_t round = 0; round < rounds; round++) {
        fsm_bound zone[16];
        random_zone(zone, 3);
        check_time_and_bounds(zone, 3);
        check_back(zone, 3);
        check_extrapolation(zone);
        check_forgetting(zone);
        random_zone(zone, 4);
        check_time_and_bounds(zone, 4);
        check_back(zone, 4);
        check_map(zone);
        check_cover();
    }
    printf("%u\n", rounds);
    return 0;
}
