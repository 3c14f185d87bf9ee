/* posix_threads.c: the POSIX host in real time. A thread posts 1000 events through a mailbox that
 * is too small for them and tries again until there is room; then it ends the loop by a signal.
 *
 * Usage: posix_threads periodic|tickless. The machine counts: `hit` adds a number, and a timer that
 * is armed anew every tick adds one. */
#define _POSIX_C_SOURCE 200809L
#include "tally.h"
#include "fsm_mailbox.h"
#include "posix/fsm_posix.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

enum { EVENTS = 1000 };

FSM_MAILBOX(tally, TALLY_QUEUE, 16)

static tally machine;
static tally_mailbox box;
static fsm_posix host;

static void step(void *context, uint32_t now)
{
    tally_mailbox_run(&box, context, now);
}

static bool next(const void *context, uint32_t *deadline)
{
    return tally_next_deadline(context, deadline);
}

static void *produce(void *unused)
{
    for (uint32_t i = 1; i <= EVENTS; i++) {
        tally_event e = TALLY_NO_EVENT;
        e.event = TALLY_EVENT_HIT;
        e.of.hit.weight = i;
        while (!tally_mailbox_put(&box, &e))
            (void)sched_yield();
        fsm_posix_wake(&host);
    }
    while (fsm_ring_count(&box.ring) != 0u)
        (void)sched_yield();
    (void)kill(getpid(), SIGTERM);
    return unused;
}

int main(int argc, char **argv)
{
    pthread_t thread;
    int error = fsm_posix_init(&host, TALLY_TICK_US);
    if (error != 0 || argc < 2 || fsm_posix_stop_on(&host, SIGTERM) != 0)
        return 2;
    host.priority = 50;
    host.lock_memory = true;
    tally_init(&machine);
    tally_start(&machine, 0);
    if (pthread_create(&thread, NULL, produce, NULL) != 0)
        return 2;
    error = strcmp(argv[1], "periodic") == 0 ? fsm_posix_periodic(&host, step, &machine)
                                             : fsm_posix_tickless(&host, step, next, &machine);
    (void)pthread_join(thread, NULL);
    printf("sum %lu ticks %d\n", (unsigned long)machine.data.sum, machine.data.ticks > 0);
    fsm_posix_print(&host, stdout);
    fsm_posix_close(&host);
    return error;
}
