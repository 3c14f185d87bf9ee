/* Sets as diagrams against sets as bits: random ones over a few small levels, with garbage collected all the time. Prints how many
 * operations were compared; 1 and a line if one differs. */
#include "symbolic/mdd.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 4, VALUES = 5, ALL = VALUES * VALUES * VALUES * VALUES, SETS = 12, ROUNDS = 3000 };

typedef struct {
    unsigned char has[ALL];
} bits;

static uint32_t seed = 1;

static uint32_t random_below(uint32_t count)
{
    seed = seed * 1664525u + 1013904223u;
    return (seed >> 8) % count;
}

static uint32_t value_at(uint32_t number, uint32_t level)
{
    for (; level > 1; level--)
        number /= VALUES;
    return number % VALUES;
}

static uint32_t node_of(fsm_mdd *mdd, uint32_t terminal, const bits *set, uint32_t level, uint32_t first, uint32_t step)
{
    if (level == 0)
        return set->has[first] ? terminal : 0;
    size_t base = fsm_mdd_start(mdd);
    for (uint32_t value = 0; value < VALUES; value++) {
        uint32_t below = node_of(mdd, terminal, set, level - 1, first + value * step, step / VALUES);
        if (below != 0)
            (void)fsm_mdd_push(mdd, value, below);
    }
    return fsm_mdd_make(mdd, level, base);
}

/* The same by single elements, through buffers. */
static uint32_t one_by_one(fsm_mdd *mdd, uint32_t terminal, const bits *set)
{
    uint32_t found = 0;
    for (uint32_t number = 0; number < ALL; number++) {
        uint32_t node = terminal;
        for (uint32_t level = 1; set->has[number] && level <= LEVELS; level++) {
            fsm_mdd_buffer *buffer = fsm_mdd_take(mdd, level);
            (void)fsm_mdd_set(mdd, buffer, value_at(number, level), node);
            node = fsm_mdd_finish(mdd, buffer);
        }
        if (set->has[number])
            found = fsm_mdd_union(mdd, found, node);
    }
    return found;
}

static int differs(const fsm_mdd *mdd, uint32_t node, const bits *set)
{
    for (uint32_t number = 0; number < ALL; number++) {
        uint32_t at = node;
        for (uint32_t level = LEVELS; at != 0 && level > 0; level--)
            at = fsm_mdd_child(mdd, at, value_at(number, level));
        if ((at != 0) != set->has[number])
            return 1;
    }
    return 0;
}

int main(int argc, char **argv)
{
    fsm_mdd mdd = {.fail_at = 0};
    bits sets[SETS];
    uint32_t nodes[SETS] = {0}, compared = 0;
    uint32_t every = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 64;
    if (!fsm_mdd_init(&mdd, LEVELS, (size_t)1 << 26, 4))
        return 2;
    uint32_t terminal = fsm_mdd_terminal(&mdd, 0, 1);
    memset(sets, 0, sizeof sets);
    for (int i = 0; i < SETS; i++)
        (void)fsm_mdd_root(&mdd, 0);
    for (uint32_t round = 0; round < ROUNDS; round++) {
        uint32_t a = random_below(SETS), b = random_below(SETS), to = random_below(SETS), what = random_below(4);
        bits made;
        uint32_t node;
        for (uint32_t i = 0, dense = 1 + random_below(40); i < ALL; i++)
            made.has[i] = what == 0 ? random_below(dense) == 0
                : what == 1         ? sets[a].has[i] | sets[b].has[i]
                : what == 2         ? sets[a].has[i] & sets[b].has[i]
                                    : sets[a].has[i] & !sets[b].has[i];
        switch (what) {
        case 0:
            node = node_of(&mdd, terminal, &made, LEVELS, 0, ALL / VALUES);
            if (node != one_by_one(&mdd, terminal, &made)) {
                printf("two diagrams of one set in round %u\n", (unsigned)round);
                return 1;
            }
            break;
        case 1:
            node = fsm_mdd_union(&mdd, nodes[a], nodes[b]);
            break;
        case 2:
            node = fsm_mdd_intersection(&mdd, nodes[a], nodes[b]);
            break;
        default:
            node = fsm_mdd_difference(&mdd, nodes[a], nodes[b]);
        }
        if (differs(&mdd, node, &made)) {
            printf("operation %u differs in round %u\n", (unsigned)what, (unsigned)round);
            return 1;
        }
        sets[to] = made;
        nodes[to] = mdd.roots[to] = node;
        if (mdd.created_since >= every)
            fsm_mdd_collect(&mdd);
        compared++;
    }
    printf("%u %u\n", (unsigned)compared, (unsigned)mdd.collections);
    fsm_mdd_free(&mdd);
    return 0;
}
