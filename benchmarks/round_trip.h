/* round_trip.h: what both nodes of a round trip do in each cycle; included after `node`, with NODE(rest).
 * The near one, compiled with -DNEAR, measures from the cycle that sends to the cycle in which the answer is
 * taken, and serves again. */
#ifndef ROUND_TRIP_H
#define ROUND_TRIP_H

#include <stdint.h>
#include <time.h>

#ifdef NEAR
enum { MOST = 1000000 };

static uint32_t round_trips[MOST]; /* in ns */
static unsigned count;
static uint64_t sent_ns;

static uint64_t clock_ns(void)
{
    struct timespec at = {0, 0};
    (void)clock_gettime(CLOCK_MONOTONIC, &at);
    return (uint64_t)at.tv_sec * 1000000000u + (uint64_t)at.tv_nsec;
}
#endif

static void step(void *unused, uint32_t now)
{
    (void)unused;
    (void)NODE(_cycle)(&node, now);
#ifdef NEAR
    if (!ping_in(&node.ping, PING_STATE_HOLDING)) {
        return;
    }
    if (sent_ns != 0u && count < MOST) {
        round_trips[count] = (uint32_t)(clock_ns() - sent_ns);
        count++;
    }
    sent_ns = clock_ns();
    (void)ping_post_serve(&node.ping);
    (void)NODE(_cycle)(&node, now);
#endif
}

#endif
