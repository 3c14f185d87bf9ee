/* node.c: a node of the round trip, as `near` serves and measures, or as `far` returns, by topics of DDS.
 *
 * Compiled with -DNEAR or without; see __main__.py. Usage:
 *
 *   near|far PERIOD_US PRIORITY SECONDS EVERY_US
 *
 * It prints the number of its process, then, after a line on the standard input, runs. `near` prints
 * each round trip in ns, from the cycle that sends to the cycle in which the answer is taken. */
#define _POSIX_C_SOURCE 200809L
#ifdef NEAR
#include "trip_near.h"
#include "trip_near_dds.h"
#define NODE(rest) trip_near##rest
#else
#include "trip_far.h"
#include "trip_far_dds.h"
#define NODE(rest) trip_far##rest
#endif
#include "posix/fsm_posix.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static fsm_posix host;
static fsm_link wire;
static fsm_link_fan fan;
static fsm_link_dds topics;
static NODE() node;

#include "round_trip.h"

int main(int argc, char **argv)
{
    const struct timespec ms = {0, 1000000};
    char line[8];
    int error, priority, carrier;
    if (argc != 5) {
        fputs("usage: PERIOD_US PRIORITY SECONDS EVERY_US\n", stderr);
        return 2;
    }
    priority = atoi(argv[2]);
    carrier = priority > 0 ? priority + 2 : 0;
    error = fsm_posix_init(&host, (uint32_t)atoi(argv[1]));
    if (error != 0 || fsm_posix_stop_on(&host, SIGALRM) != 0)
        return 2;
    host.priority = priority;
    host.lock_memory = priority > 0;
    host.is_explained = false; /* no call but the sleep */
    fsm_posix_lock(&host);
    fsm_link_init(&wire, &NODE(_map), 1u);
    error = fsm_link_fan_open(&fan, &wire);
    fan.every_us = (uint32_t)atoi(argv[4]);
    if (error == 0)
        error = fsm_link_dds_open(&topics, &fan, &NODE(_dds_other), carrier);
    if (error == 0)
        error = fsm_link_fan_start(&fan, carrier);
    if (error != 0) {
        fprintf(stderr, "no topics: %d\n", error);
        return 2;
    }
    while (fsm_link_dds_unheard(&topics) > 0u || fsm_link_dds_unserved(&topics) > 0u)
        (void)nanosleep(&ms, NULL);
    printf("%d\n", (int)getpid());
    (void)fflush(stdout);
    if (fgets(line, sizeof line, stdin) == NULL)
        return 2;
    NODE(_init)(&node);
    node.link = &wire;
    (void)NODE(_start)(&node, 0u);
    (void)alarm((unsigned)atoi(argv[3]));
    error = fsm_posix_periodic(&host, step, NULL);
    fprintf(stderr, "lost %u events, %u unsent\n", fsm_link_count(&wire, 1u, FSM_LINK_LOST_EVENTS),
            fsm_link_dds_count(&topics, FSM_LINK_DDS_UNSENT));
#ifdef NEAR
    for (unsigned i = 0; i < count; i++)
        printf("%u\n", round_trips[i]);
#endif
    fsm_link_fan_close(&fan);
    fsm_link_dds_close(&topics);
    fsm_posix_close(&host);
    return error;
}
