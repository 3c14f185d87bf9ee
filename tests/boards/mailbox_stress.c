/* mailbox_stress.c: threads post numbered events into a mailbox each, while one thread runs the
 * machine: every event arrives once and in order, or is counted as lost. With -DSHARED they all
 * post into one mailbox, which a mutex guards.
 *
 * Usage: mailbox_stress EVENTS. The machine is a stand-in with the interface of a generated one. */
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <stdbool.h>
#include <stdint.h>

enum { QUEUE = 3, SLOTS = 32, PRODUCERS = 3, PATIENT = 0 /* tries again until there is room */ };

typedef struct {
    uint32_t number;
    uint32_t twice; /* of `number`: an event that was torn would show */
    uint8_t from;
} toy_event;

typedef struct {
    toy_event queue[QUEUE];
    unsigned count;
    uint32_t next[PRODUCERS]; /* the least number that may come */
    uint32_t arrived[PRODUCERS];
    unsigned wrong;
} toy;

static bool toy_post(toy *m, const toy_event *e)
{
    if (m->count == QUEUE)
        return false;
    m->queue[m->count++] = *e;
    return true;
}

static void toy_run(toy *m, uint32_t now)
{
    (void)now;
    for (unsigned i = 0; i < m->count; i++) {
        const toy_event *e = &m->queue[i];
        if (e->from >= PRODUCERS || e->number < m->next[e->from] || e->twice != 2u * e->number) {
            m->wrong++;
            continue;
        }
        m->next[e->from] = e->number + 1u;
        m->arrived[e->from]++;
    }
    m->count = 0;
}

#ifdef SHARED
static pthread_mutex_t producers = PTHREAD_MUTEX_INITIALIZER;
#ifndef UNGUARDED
#define FSM_ENTER_CRITICAL() (void)pthread_mutex_lock(&producers)
#define FSM_EXIT_CRITICAL() (void)pthread_mutex_unlock(&producers)
#endif
#endif
#include "fsm_mailbox.h"
FSM_MAILBOX(toy, QUEUE, SLOTS)

#ifdef SHARED
enum { BOXES = 1 };
#else
enum { BOXES = PRODUCERS };
#endif
static toy_mailbox boxes[BOXES];
static const uint8_t numbers[PRODUCERS] = {0, 1, 2};
static uint32_t reported_lost[PRODUCERS]; /* the losses reported to each producer; read after it ended */
static uint32_t events;
static fsm_shared ended;
static pthread_mutex_t ending = PTHREAD_MUTEX_INITIALIZER;

/* Who waits for room is slow. */
static uint32_t share(unsigned from)
{
    return from == PATIENT ? events / 16u : events;
}

static void *produce(void *argument)
{
    const uint8_t from = *(const uint8_t *)argument;
    toy_mailbox *box = &boxes[from % BOXES];
    for (uint32_t i = 0; i < share(from); i++) {
        toy_event e = {i, 2u * i, from};
        while (!toy_mailbox_put(box, &e)) {
            reported_lost[from]++;
            if (from != PATIENT)
                break;
            (void)sched_yield();
        }
        if (i % 256u == 0u)
            (void)sched_yield();
    }
    (void)pthread_mutex_lock(&ending);
    fsm_shared_write(&ended, (FSM_INDEX)(fsm_shared_read(&ended) + 1u));
    (void)pthread_mutex_unlock(&ending);
    return NULL;
}

int main(int argc, char **argv)
{
    pthread_t threads[PRODUCERS];
    static toy machine;
    unsigned failures = 0;
    bool last = false;
    events = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 100000u;
    for (unsigned i = 0; i < PRODUCERS; i++)
        if (pthread_create(&threads[i], NULL, produce, (void *)(uintptr_t)&numbers[i]) != 0)
            return 2;
    while (!last) {
        last = fsm_shared_read(&ended) == PRODUCERS; /* then this round finds all there is */
        for (unsigned i = 0; i < BOXES; i++)
            toy_mailbox_run(&boxes[i], &machine, 0);
    }
    for (unsigned i = 0; i < PRODUCERS; i++) {
        (void)pthread_join(threads[i], NULL);
        printf("producer %u: sent %u arrived %u lost %u\n", i, (unsigned)share(i),
               (unsigned)machine.arrived[i], (unsigned)reported_lost[i]);
        failures += machine.arrived[i] != (i == PATIENT ? share(i) : events - reported_lost[i]);
        failures += machine.arrived[i] == 0;
    }
    for (unsigned i = 0; i < BOXES; i++) {
        uint32_t told = 0;
        for (unsigned from = i; from < PRODUCERS; from += BOXES)
            told += reported_lost[from];
        failures += toy_mailbox_lost(&boxes[i]) != told;
    }
    printf("wrong %u failures %u\n", machine.wrong, failures);
    return machine.wrong + failures == 0 ? 0 : 1;
}
