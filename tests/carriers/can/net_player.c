/* net_player.c: the node `a` of test_net.py on a bus, until the standard input ends; then what was
 * counted. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link_net.h"
#include "line_a.h"
#include "line_a_can.h"

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>

static fsm_link wire;
static fsm_link_net net;
static line_a node;

int main(int argc, char **argv)
{
    struct pollfd end = {0, POLLIN, 0};
    uint32_t now = 0u;
    int error;
    if (argc != 3)
        return 1;
    fsm_link_init(&wire, &line_a_map, (uint32_t)strtoul(argv[2], NULL, 0));
    error = fsm_link_net_open(&net, &wire, &line_a_can, argv[1]);
    if (error != 0) {
        printf("error %d\n", error);
        return 1;
    }
    if (fsm_link_connect(&wire, 10000u) != FSM_LINK_READY)
        printf("alone\n");
    line_a_init(&node);
    node.link = &wire;
    line_a_start(&node, 0u);
    printf("ready\n");
    (void)fflush(stdout);
    while (poll(&end, 1u, 1) == 0)
        line_a_cycle(&node, now++);
    for (int what = 0; what < FSM_LINK_COUNTS; what++)
        printf("%" PRIu32 " ", fsm_link_count(&wire, LINE_A_NODE_B, (fsm_link_counter)what));
    for (int what = 0; what < FSM_LINK_TOTALS; what++)
        printf("%" PRIu32 " ", fsm_link_counted(&wire, (fsm_link_total)what));
    printf("%" PRIu32 " %d\n", fsm_link_session(&wire, LINE_A_NODE_B), (int)node.echo.in.wanted);
    fsm_link_net_close(&net);
    return 0;
}
