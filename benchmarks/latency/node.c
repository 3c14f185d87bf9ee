/* node.c: a node of the round trip, as `near` serves and measures, or as `far` returns.
 *
 * Compiled with -DNEAR or without; see __main__.py. Usage:
 *
 *   near|far PERIOD_US PRIORITY LINK_PRIORITY SECONDS NEAR_ENDPOINT FAR_ENDPOINT
 *
 * `near` prints the report of its loop (fsm_posix_print_json), then a line with each round trip in ns, from
 * the cycle that sends to the cycle in which the answer is taken, of its own clock. */
#define _POSIX_C_SOURCE 200809L
#ifdef NEAR
#include "round_trip_near.h"
#define NODE(rest) round_trip_near##rest
enum { PEER = ROUND_TRIP_NEAR_NODE_FAR };
#else
#include "round_trip_far.h"
#define NODE(rest) round_trip_far##rest
enum { PEER = ROUND_TRIP_FAR_NODE_NEAR };
#endif
#include "fsm_link_zmq.h"
#include "posix/fsm_posix.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static fsm_posix host;
static fsm_link link_to_peer;
static fsm_link_zmq carrier;
static NODE() node;

#include "round_trip.h"

static void print_round_trips(void)
{
#ifdef NEAR
    printf("[");
    for (unsigned i = 0; i < count; i++)
        printf("%s%u", i == 0u ? "" : ", ", round_trips[i]);
    printf("]\n");
#endif
}

static int run(char **argv)
{
    const char *endpoints[2];
    fsm_link_zmq_options options = {0};
    const int link_priority = atoi(argv[3]);
    int error = fsm_posix_init(&host, (uint32_t)atoi(argv[1]));
    if (error != 0 || fsm_posix_stop_on(&host, SIGALRM) != 0)
        return 2;
    host.priority = atoi(argv[2]);
    host.lock_memory = host.priority > 0;
    host.is_explained = false; /* no call but the sleep */
    fsm_posix_lock(&host);
    endpoints[0] = argv[5];
    endpoints[1] = argv[6];
    options.endpoints = endpoints;
    options.send_priority = options.receive_priority = options.io_priority = link_priority;
    fsm_link_init(&link_to_peer, &NODE(_map), (uint32_t)time(NULL));
    error = fsm_link_zmq_open(&carrier, &link_to_peer, &options);
    if (error != 0) {
        fprintf(stderr, "%s: %s\n", carrier.failed, strerror(error));
        return 2;
    }
    if (carrier.priority_error != 0)
        fprintf(stderr, "priority of the link: %s\n", strerror(carrier.priority_error));
    if (fsm_link_connect(&link_to_peer, 10000u) != FSM_LINK_READY) {
        fputs("the other node does not answer\n", stderr);
        return 2;
    }
    NODE(_init)(&node);
    node.link = &link_to_peer;
    (void)NODE(_start)(&node, 0u);
    (void)alarm((unsigned)atoi(argv[4]));
    error = fsm_posix_periodic(&host, step, NULL);
    fsm_posix_print_json(&host, stdout);
    print_round_trips();
    fprintf(stderr, "lost %u frames, %u events\n",
            fsm_link_count(&link_to_peer, PEER, FSM_LINK_LOST_FRAMES),
            fsm_link_count(&link_to_peer, PEER, FSM_LINK_LOST_EVENTS));
    fsm_link_zmq_close(&carrier);
    fsm_posix_close(&host);
    return error;
}

int main(int argc, char **argv)
{
    if (argc == 7)
        return run(argv);
    fputs("usage: PERIOD_US PRIORITY LINK_PRIORITY SECONDS NEAR_ENDPOINT FAR_ENDPOINT\n", stderr);
    return 2;
}
