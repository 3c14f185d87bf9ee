/* The lossy table alone: what it takes for known, against what it says of itself.
 *
 *   explorer_lossy hash-compact|bitstate BYTES STATES PROBES
 *
 * Puts so many states, all different, as a model numbers them: both halves small. Prints how many were added, how many
 * of them it knows, lines of a part, and, after as many other states were looked up, how many of those it takes for
 * known; then how full each part is. */
#include "store/hash_compaction.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static fsm_state state_of(uint32_t number)
{
    return fsm_join(number / 1000, number % 1000);
}

int main(int argc, char **argv)
{
    if (argc < 5)
        return 2;
    fsm_storage storage = strcmp(argv[1], "bitstate") == 0 ? FSM_BITSTATE : FSM_HASH_COMPACT;
    uint32_t states = (uint32_t)strtoul(argv[3], NULL, 10), probes = (uint32_t)strtoul(argv[4], NULL, 10);
    uint64_t added = 0, known = 0, matched = 0, counted = 0;
    fsm_hash_compaction table;
    if (!fsm_hash_compaction_init(&table, storage, (size_t)strtoull(argv[2], NULL, 10)))
        return 2;
    for (uint32_t i = 0; i < states; i++) {
        fsm_put put = fsm_hash_compaction_put(&table, fsm_hash_compaction_home(&table, state_of(i)));
        if (put == FSM_NO_ROOM)
            break;
        added += put == FSM_ADDED;
    }
    for (uint32_t i = 0; i < states; i++)
        known += fsm_hash_compaction_has(&table, fsm_hash_compaction_home(&table, state_of(i)));
    for (uint32_t i = 0; i < probes; i++)
        matched += fsm_hash_compaction_has(&table, fsm_hash_compaction_home(&table, state_of(states + i)));
    for (uint32_t part = 0; part < FSM_HASH_COMPACTION_PARTS; part++)
        counted += table.parts[part].count;
    printf("%llu %llu %llu %llu %d", (unsigned long long)added, (unsigned long long)known,
           (unsigned long long)table.lines, (unsigned long long)matched, counted == added);
    for (uint32_t part = 0; part < FSM_HASH_COMPACTION_PARTS; part++)
        printf(" %llu", (unsigned long long)fsm_hash_compaction_filled(&table, part));
    printf("\n");
    fsm_hash_compaction_free(&table);
    return 0;
}
