/* bus_player.c: the node `a` of test_carrier.py on a bus, until the standard input ends; then what was
 * counted. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link_can.h"
#include "oven_a.h"
#include "oven_a_can.h"

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>

static fsm_link wire;
static fsm_link_fan fan;
static fsm_link_can can;
static oven_a node;

int main(int argc, char **argv)
{
    struct pollfd end = {0, POLLIN, 0};
    uint32_t now = 0u;
    int error;
    fsm_link_init(&wire, &oven_a_map, 7u);
    if (argc != 2 || fsm_link_fan_open(&fan, &wire) != 0)
        return 1;
    error = fsm_link_can_open(&can, &fan, &oven_a_can_heater, argv[1]);
    if (error != 0) {
        printf("error %d\n", error);
        return 1;
    }
    if (fsm_link_fan_start(&fan, 0) != 0)
        return 1;
    oven_a_init(&node);
    node.link = &wire;
    oven_a_start(&node, 0u);
    printf("ready\n");
    (void)fflush(stdout);
    while (poll(&end, 1u, 1) == 0)
        oven_a_cycle(&node, now++);
    fsm_link_fan_close(&fan);
    for (int what = 0; what < FSM_LINK_CAN_COUNTS; what++)
        printf("%" PRIu32 " ", fsm_link_can_count(&can, (fsm_link_can_counter)what));
    printf("malformed %" PRIu32, fsm_link_counted(&wire, FSM_LINK_MALFORMED));
    printf(" restarts %" PRIu32, fsm_link_count(&wire, OVEN_A_NODE_HEATER, FSM_LINK_RESTARTS));
    printf(" temperature %d\n", (int)node.control.in.temperature);
    fsm_link_can_close(&can);
    return 0;
}
