/* order.h: orders of the machines of a system in which those that talk stand near each other, by FORCE (Aloul, Markov,
 * Sakallah 2003, "FORCE: a fast and easy-to-implement variable-ordering heuristic") from many starts, and then by exchanges. */
#ifndef FSM_ORDER_H
#define FSM_ORDER_H

#include "system/system.h"

typedef struct {
    uint32_t *machines; /* the highest first */
    double cost;        /* the distance over which each wire goes, all together */
} fsm_order;

/* At most `most` orders, all different, the best first; the same each time. Returns how many; 0 if memory ran out. */
uint32_t fsm_find_orders(const fsm_system *system, fsm_order *orders, uint32_t most);
void fsm_free_orders(fsm_order *orders, uint32_t count);

#endif
