/* symbolic_main.h: the explorer where states are kept as a diagram: its options, and its result as that of other searches. */
#ifndef FSM_SYMBOLIC_MAIN_H
#define FSM_SYMBOLIC_MAIN_H

#include "report.h"

typedef struct {
    size_t memory;
    fsm_pace *pace;
    bool livelock;
    const char *order; /* machines, the highest first, separated by commas; NULL: one is sought */
    const char *ways;  /* marks that are asked for, and to which ways are shown if they are found; NULL: none */
    bool sleepless;    /* see fsm_search */
    /* For tests: */
    uint32_t cache_bits;    /* see fsm_mdd_init */
    uint32_t collect_every; /* garbage is collected as soon as so many nodes were made; 0: as is best */
    size_t fail_at;         /* see fsm_mdd */
} fsm_symbolic_options;

int fsm_symbolic_explore(const fsm_symbolic_options *options);

#endif
