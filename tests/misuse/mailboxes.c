/* mailboxes.c: two threads post into mailboxes of a generated machine, before it is started, while
 * it is started anew, and faster than it runs. Each event is handled, was refused by a full
 * mailbox, or was given up in the queue of a machine that was started anew.
 *
 * Usage: mailboxes EVENTS, for each thread. */
#include "abused.h"
#include "fsm_mailbox.h"

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>

FSM_MAILBOX(abused, ABUSED_QUEUE, 16)

typedef struct {
    abused_mailbox box;
    uint32_t events, accepted, refused;
} producer;

static abused machine;
static producer producers[2];
static uint32_t handled;

void abused_touched(abused *m, uint32_t number)
{
    (void)m;
    (void)number;
    handled++;
}

static void *post_all(void *context)
{
    producer *p = context;
    for (uint32_t i = 0u; i < p->events; i++) {
        abused_event tap = ABUSED_NO_EVENT;
        tap.event = ABUSED_EVENT_TAP;
        tap.of.tap.number = i;
        if (abused_mailbox_put(&p->box, &tap)) {
            p->accepted++;
        } else {
            p->refused++;
            (void)sched_yield();
        }
    }
    return NULL;
}

static bool is_empty(const producer *p)
{
    return fsm_ring_count(&p->box.ring) == 0u;
}

int main(int count, char **words)
{
    const uint32_t events = count == 2 ? (uint32_t)strtoul(words[1], NULL, 10) : 0u;
    pthread_t threads[2];
    uint32_t now = UINT32_MAX - 1000u, given_up = 0u, is_right = 1u;
    abused_init(&machine);
    for (int i = 0; i < 2; i++) {
        producers[i].events = events;
        if (pthread_create(&threads[i], NULL, post_all, &producers[i]) != 0)
            return 2;
    }
    for (int i = 0; i < 100; i++) /* not started: nothing leaves a mailbox */
        for (int k = 0; k < 2; k++)
            is_right &= abused_mailbox_drain(&producers[k].box, &machine) == 0u;
    for (uint32_t done = 0u; done < events || !is_empty(&producers[0]) || !is_empty(&producers[1]);
         done++) {
        if (done % 64u == 0u) {
            given_up += machine.fsm.queue_count;
            abused_start(&machine, now);
        }
        (void)abused_mailbox_drain(&producers[0].box, &machine);
        (void)abused_mailbox_drain(&producers[1].box, &machine);
        if (done % 8u != 7u)
            abused_mailbox_run(&producers[done % 2u].box, &machine, now++);
        (void)sched_yield();
    }
    for (int i = 0; i < 2; i++)
        (void)pthread_join(threads[i], NULL);
    for (int i = 0; i < 2; i++)
        while (!is_empty(&producers[i]))
            abused_mailbox_run(&producers[i].box, &machine, now);
    abused_run(&machine, now);
    uint32_t accepted = 0u, refused = 0u;
    for (int i = 0; i < 2; i++) {
        accepted += producers[i].accepted;
        refused += producers[i].refused;
        is_right &= producers[i].refused == abused_mailbox_lost(&producers[i].box);
    }
    printf("other threads: posted %u, handled %u, refused %u, given up %u\n", (unsigned)(2u * events),
           (unsigned)handled, (unsigned)refused, (unsigned)given_up);
    is_right &= accepted + refused == 2u * events && accepted == handled + given_up;
    return is_right != 0u ? 0 : 1;
}
