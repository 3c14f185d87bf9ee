/* The dining philosophers as a raw fsm_model: checks store, search, livelock and traps.
 *
 *   explorer_toy COUNT left|mixed|busy [BYTES]
 *
 * Each philosopher takes one fork, then the other, eats, and puts both down. With `left` all take the
 * left one first, which deadlocks; with `mixed` the last takes the right one first; `busy` is `left`
 * with every step internal, which is a livelock. Prints how the search ended, states,
 * transitions, depth, the length of the shortest path to a deadlock (0: none), whether there is a
 * cycle of internal steps, and the number of traps. */
#include "cycles.h"
#include "search.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 12 };
enum { THINKING, HOLDING, EATING };

static uint32_t count;
static bool mixed, busy;

static uint32_t first_fork(uint32_t i)
{
    return mixed && i == count - 1 ? (i + 1) % count : i;
}

static uint32_t second_fork(uint32_t i)
{
    return mixed && i == count - 1 ? i : (i + 1) % count;
}

static bool is_free(const unsigned char *state, uint32_t fork)
{
    for (uint32_t i = 0; i < count; i++)
        if ((state[i] >= HOLDING && first_fork(i) == fork) || (state[i] == EATING && second_fork(i) == fork))
            return false;
    return true;
}

static bool initial(void *self, fsm_emit *emit, void *context)
{
    (void)self;
    unsigned char state[MOST] = {0};
    fsm_step step = {state, NULL, 0, FSM_STEP_ENVIRONMENT};
    return emit(context, &step);
}

static bool successors(void *self, const void *bytes, fsm_emit *emit, void *context)
{
    (void)self;
    for (uint32_t i = 0; i < count; i++) {
        unsigned char state[MOST];
        memcpy(state, bytes, sizeof state);
        uint32_t wanted = state[i] == THINKING ? first_fork(i) : second_fork(i);
        if (state[i] != EATING && !is_free(state, wanted))
            continue;
        fsm_kind kind = state[i] == THINKING && !busy ? FSM_STEP_ENVIRONMENT : FSM_STEP_INTERNAL;
        state[i] = (unsigned char)((state[i] + 1) % 3);
        uint32_t mark = 1;
        fsm_step step = {state, &mark, state[i] == EATING, kind};
        if (!emit(context, &step))
            return false;
    }
    return true;
}

static bool stop_at_first(void *context, const fsm_step *step)
{
    (void)context;
    (void)step;
    return false;
}

static uint32_t marks(void *self, const void *state, uint32_t *found)
{
    if (!successors(self, state, stop_at_first, NULL))
        return 0;
    found[0] = 0;
    return 1;
}

static uint32_t configuration(void *self, const void *bytes)
{
    const unsigned char *state = bytes;
    uint32_t shown = 0;
    (void)self;
    for (uint32_t i = 0; i < count; i++)
        shown = shown * 3 + state[i];
    return shown;
}

static bool at_rest(void *self, const void *bytes)
{
    (void)self;
    (void)bytes;
    return false;
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

static void note_trap(void *context, uint32_t state)
{
    (void)context;
    (void)state;
    trap_count++;
}

int main(int argc, char **argv)
{
    if (argc < 3)
        return 2;
    count = (uint32_t)strtoul(argv[1], NULL, 10);
    mixed = strcmp(argv[2], "mixed") == 0;
    busy = strcmp(argv[2], "busy") == 0;
    size_t limit = argc > 3 ? (size_t)strtoull(argv[3], NULL, 10) : (size_t)1 << 30;
    fsm_model model = {FSM_MODEL_ABI, MOST, 2, NULL, initial, successors, marks, configuration, at_rest,
                       memory, failure};
    fsm_search search;
    if (!fsm_search_init(&search, &model, limit))
        return 2;
    fsm_search_run(&search);
    fsm_cycle cycle = {.state = FSM_NONE};
    bool fine = search.outcome == FSM_COMPLETE && fsm_find_livelock(&search, &cycle)
        && fsm_find_traps(&search, note_trap, NULL);
    uint32_t path[4096];
    uint32_t length = search.witnesses[0].count == 0 ? 0 : fsm_search_path(&search, search.witnesses[0].state, path);
    printf("%d %u %llu %u %u %d %u %llu\n", fine ? 0 : (int)search.outcome, (unsigned)search.passed.count,
           (unsigned long long)search.transitions, (unsigned)search.depth, (unsigned)length,
           cycle.state != FSM_NONE, (unsigned)trap_count, (unsigned long long)search.witnesses[1].count);
    free(cycle.steps);
    fsm_search_free(&search);
    return 0;
}
