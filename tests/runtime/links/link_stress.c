/* link_stress.c: the loop of a node against the threads of a transport, which here are a sender that
 * carries frames over to a second link, and so is its receiver; and the loop of that one.
 *
 * Prints `fine`, the events that came, and the levels that were passed over. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link.h"
#include "talk_a.h"

#include <inttypes.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>

enum { CYCLES = 20000, BURST = 3, LEVEL_BYTES = 5 };

static fsm_link from, to;
static fsm_shared sent_all, carried_all;

void west_push(west *m, uint8_t how)
{
    (void)m;
    (void)how;
}

void talk_a_west_hit(talk_a *s, uint16_t n, bool last)
{
    (void)s;
    (void)n;
    (void)last;
}

static bool anything(uint8_t sender, uint16_t message, const uint8_t *payload)
{
    (void)sender;
    (void)message;
    (void)payload;
    return true;
}

/* Bytes of a level that belong together: a number and its complement. */
static void fill(uint8_t *payload, uint32_t number)
{
    fsm_link_put_bytes(payload, number, 2u);
    fsm_link_put_bytes(payload + 2, ~number, 2u);
    payload[4] = 0u;
}

static void *loop(void *unused)
{
    uint32_t number = 0u;
    for (uint32_t cycle = 1u; cycle <= CYCLES; cycle++) {
        uint8_t *payload;
        fsm_link_begin(&from);
        for (int i = 0; i < BURST; i++) {
            payload = fsm_link_claim(&from, 1u);
            if (payload != NULL) {
                fsm_link_put_bytes(payload, number % 65536u, 2u);
                payload[2] = 0u;
                fsm_link_put(&from);
            }
            number++; /* refused ones count as well */
        }
        payload = fsm_link_levels_out(&from);
        if (payload != NULL)
            fill(payload, cycle);
        fsm_link_end(&from);
        if (cycle % 16u == 0u)
            sched_yield();
    }
    fsm_shared_write(&sent_all, 1u);
    return unused;
}

static void *carry(void *unused)
{
    fsm_link_frame frame;
    for (;;) {
        bool is_last = fsm_shared_read(&sent_all) != 0u;
        while (fsm_link_next(&from, &frame))
            (void)fsm_link_arrive(&to, 0u, frame.bytes, frame.length);
        if (is_last)
            break;
        sched_yield();
    }
    fsm_shared_write(&carried_all, 1u);
    return unused;
}

static const char *wrong;
static uint32_t came, levels;

static void *listen(void *unused)
{
    uint32_t last_level = 0u, last_event = 0u;
    bool is_first = true, is_last;
    do {
        const fsm_link_frame *frame;
        const uint8_t *payload;
        is_last = fsm_shared_read(&carried_all) != 0u;
        fsm_link_begin(&to);
        payload = fsm_link_levels(&to, 0u);
        if (payload != NULL) {
            uint32_t number = (uint32_t)fsm_link_get_bytes(payload, 2u);
            uint32_t other = (uint32_t)fsm_link_get_bytes(payload + 2, 2u);
            levels++;
            if ((number ^ other) != 0xFFFFu)
                wrong = "a level was torn";
            if (number < last_level)
                wrong = "a level came after a later one";
            last_level = number;
        }
        while ((frame = fsm_link_front(&to)) != NULL) {
            uint32_t number = (uint32_t)fsm_link_get_bytes(frame->bytes + FSM_LINK_HEADER, 2u);
            if (number != frame->number % 65536u)
                wrong = "an event has another's number";
            if (!is_first && frame->number <= last_event)
                wrong = "events out of order";
            is_first = false;
            last_event = frame->number;
            came++;
            fsm_link_release(&to);
        }
        if (!is_last)
            sched_yield();
    } while (!is_last);
    if (last_level != CYCLES)
        wrong = "the last level did not come";
    return unused;
}

int main(void)
{
    static const fsm_link_message messages[] = {{0u, 1u, 3u}};
    static const uint16_t sizes[] = {LEVEL_BYTES, 0u};
    static const char *const names[] = {"a", "b"};
    static const fsm_link_map map_a = {1u, 0u, 2u, 1u, messages, sizes, names, anything, 1u, false, 0u};
    static const fsm_link_map map_b = {1u, 1u, 2u, 1u, messages, sizes, names, anything, 1u, false, 0u};
    pthread_t threads[3];
    uint32_t all, counted;
    fsm_link_init(&from, &map_a, 1u);
    fsm_link_init(&to, &map_b, 1u);
    (void)pthread_create(&threads[0], NULL, listen, NULL);
    (void)pthread_create(&threads[1], NULL, carry, NULL);
    (void)pthread_create(&threads[2], NULL, loop, NULL);
    for (int i = 2; i >= 0; i--)
        (void)pthread_join(threads[i], NULL);
    all = (uint32_t)CYCLES * BURST;
    counted = fsm_link_count(&to, 0u, FSM_LINK_LOST_EVENTS) +
              fsm_link_count(&to, 0u, FSM_LINK_OVERFLOW) + fsm_link_count(&to, 0u, FSM_LINK_MISSED);
    /* Those that were refused after the last event that came are not known to the receiver. */
    if (came + counted > all ||
        came + counted + fsm_link_counted(&from, FSM_LINK_REFUSED) < all)
        wrong = "events are not accounted for";
    if (fsm_link_count(&to, 0u, FSM_LINK_LOST_FRAMES) != 0u)
        wrong = "a frame was lost";
    printf("%s %" PRIu32 " %" PRIu32 "\n", wrong == NULL ? "fine" : wrong, came, CYCLES - levels);
    return wrong == NULL ? 0 : 1;
}
