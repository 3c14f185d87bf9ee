/* The dining philosophers as a raw fsm_model: checks set, search, paths, livelock and traps.
 *
 *   explorer_toy COUNT left|mixed|busy [BYTES [CORES [hash-compact|bitstate]]]
 *
 * Each philosopher takes one fork, then the other, eats, and puts both down. With `left` all take the
 * left one first, which deadlocks; with `mixed` the last takes the right one first; `busy` is `left`
 * with every step internal, which is a livelock. A state has a digit for each; with `sparse` these are
 * octal ones, so that the set cannot be dense. Prints how the search ended, states, transitions, depth, the
 * length of the shortest path to a deadlock (0: none), whether there is a cycle of internal steps, the
 * number of traps, meals, whether the set was dense, and the length of a path to the last state found. With lossy
 * storage livelocks, traps and that state are not computed. */
#include "liveness/cycles.h"
#include "search/path.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { THINKING, HOLDING, EATING };

static uint32_t count;
static bool mixed, busy, sparse;

/* The weight of a philosopher's phase in the state. */
static fsm_state weight(uint32_t i)
{
    fsm_state each = sparse ? 8 : 3, found = i % 2 == 0 ? 1 : (fsm_state)1 << 32;
    for (uint32_t n = i / 2; n > 0; n--)
        found *= each;
    return found;
}

static unsigned phase(fsm_state state, uint32_t i)
{
    fsm_state half = i % 2 == 0 ? fsm_right(state) : fsm_left(state), one = weight(i);
    return (unsigned)(half / (i % 2 == 0 ? one : one >> 32) % (sparse ? 8 : 3));
}

static uint32_t first_fork(uint32_t i)
{
    return mixed && i == count - 1 ? (i + 1) % count : i;
}

static uint32_t second_fork(uint32_t i)
{
    return mixed && i == count - 1 ? i : (i + 1) % count;
}

static bool is_free(fsm_state state, uint32_t fork)
{
    for (uint32_t i = 0; i < count; i++)
        if ((phase(state, i) >= HOLDING && first_fork(i) == fork)
            || (phase(state, i) == EATING && second_fork(i) == fork))
            return false;
    return true;
}

static bool initial(void *self, fsm_steps *steps)
{
    (void)self;
    return fsm_steps_add(steps, 0, 0, FSM_STEP_ENVIRONMENT);
}

static bool successors(void *self, fsm_state state, fsm_steps *steps)
{
    (void)self;
    for (uint32_t i = 0; i < count; i++) {
        unsigned at = phase(state, i), next = (at + 1) % 3;
        if (at != EATING && !is_free(state, at == THINKING ? first_fork(i) : second_fork(i)))
            continue;
        fsm_state to = state + next * weight(i) - at * weight(i);
        fsm_kind kind = at == THINKING && !busy ? FSM_STEP_ENVIRONMENT : FSM_STEP_INTERNAL;
        if (!fsm_steps_add(steps, to, next == EATING, kind))
            return false;
    }
    steps->deadlock = steps->count == 0;
    return true;
}

static uint32_t marks(void *self, fsm_state state)
{
    (void)self;
    (void)state;
    return 0;
}

static const uint32_t *mark_set(void *self, uint32_t set, uint32_t *found)
{
    static const uint32_t meal = 1;
    (void)self;
    *found = set;
    return &meal;
}

static uint32_t configuration(void *self, fsm_state state)
{
    uint32_t shown = 0;
    (void)self;
    for (uint32_t i = 0; i < count; i++)
        shown = shown * 3 + phase(state, i);
    return shown;
}

static bool at_rest(void *self, fsm_state state)
{
    (void)self;
    (void)state;
    return false;
}

static bool fair(void *self, fsm_state state, const fsm_steps *steps, uint32_t *actions)
{
    (void)self;
    (void)state;
    for (size_t i = 0; i < steps->count; i++)
        actions[i] = FSM_NONE;
    return true;
}

static size_t memory(void *self)
{
    (void)self;
    return 0;
}

static const char *failure(void *self)
{
    (void)self;
    return NULL;
}

static uint32_t trap_count;

static void note_trap(void *context, const fsm_state *states, size_t size)
{
    (void)context;
    (void)states;
    (void)size;
    trap_count++;
}

static size_t length_to(const fsm_search *search, const fsm_found *found)
{
    fsm_path path = {0};
    size_t length = fsm_path_to(search, found, &path) ? path.count : 0;
    free(path.steps);
    return length;
}

/* The length of a path to the state at the last place that is taken. */
static size_t length_to_some(fsm_search *search)
{
    uint64_t at = fsm_set_places(&search->passed);
    while (at-- > 0 && !fsm_set_taken(&search->passed, at))
        ;
    fsm_target target = {fsm_set_at(&search->passed, at), 0};
    if (fsm_set_find(&search->passed, target.state) != at)
        return 0;
    fsm_found found;
    fsm_search_locate(search, &target, 1, &found, 1);
    return found.state == target.state && length_to(search, &found) == found.depth + 1 ? found.depth + 1 : 0;
}

int main(int argc, char **argv)
{
    if (argc < 3)
        return 2;
    count = (uint32_t)strtoul(argv[1], NULL, 10);
    mixed = strstr(argv[2], "mixed") != NULL;
    busy = strstr(argv[2], "busy") != NULL;
    sparse = strstr(argv[2], "sparse") != NULL;
    size_t limit = argc > 3 ? (size_t)strtoull(argv[3], NULL, 10) : (size_t)1 << 30;
    fsm_model model = {.abi = FSM_MODEL_ABI, .mark_count = 2, .initial = initial, .successors = successors, .marks = marks,
                       .mark_set = mark_set, .configuration = configuration, .at_rest = at_rest, .fair = fair,
                       .memory = memory, .failure = failure};
    fsm_search search;
    if (!fsm_search_init(&search, &model, limit))
        return 2;
    search.cores = argc > 4 ? (uint32_t)strtoul(argv[4], NULL, 10) : 1;
    search.large = 8;
    search.chunk = 2;
    bool lossy = argc > 5;
    if (lossy && !fsm_search_make_lossy(&search, strcmp(argv[5], "bitstate") == 0 ? FSM_BITSTATE : FSM_HASH_COMPACT, limit / 2))
        return 2;
    fsm_search_run(&search);
    fsm_cycle cycle = {.state = FSM_NO_STATE};
    bool fine = search.outcome == FSM_COMPLETE && !lossy && fsm_find_livelock(&search, &cycle)
        && fsm_find_traps(&search, note_trap, NULL);
    size_t length = search.witnesses[0].count == 0 ? 0 : length_to(&search, &search.witnesses[0].at);
    printf("%d %llu %llu %u %zu %d %u %llu %d", fine ? 0 : (int)search.outcome,
           (unsigned long long)search.passed.count, (unsigned long long)search.transitions,
           (unsigned)search.depth, length, cycle.state != FSM_NO_STATE, (unsigned)trap_count,
           (unsigned long long)search.witnesses[1].count, fsm_set_is_dense(&search.passed));
    printf(" %zu\n", fine ? length_to_some(&search) : 0);
    free(cycle.steps);
    fsm_search_free(&search);
    return 0;
}
