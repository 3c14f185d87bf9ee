/* fan_player.c: the node `a` of test_fan.py with a foreign node, whose translator counts and answers.
 *
 * A thread hands over COUNT events of the foreign node, and levels before each; the loop runs until
 * all have come. Prints what both ends counted. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link_fan.h"
#include "oven_a.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { COUNT = 2000, WARMED = 1, SET_POWER = 2, MILLISECOND = 1000000 };

static fsm_link wire;
static fsm_link_fan fan;
static oven_a node;
static fsm_shared powers, levels;

static void pass(long nanoseconds)
{
    struct timespec wish = {0, 0};
    wish.tv_nsec = nanoseconds;
    (void)nanosleep(&wish, NULL);
}

static void translate(void *translator, const fsm_link_frame *frame)
{
    (void)translator;
    if (fsm_link_message_of(frame) == FSM_LINK_LEVELS)
        fsm_shared_write(&levels, fsm_shared_read(&levels) + 1u);
    else if (fsm_link_message_of(frame) == SET_POWER && frame->bytes[FSM_LINK_HEADER] == 5u)
        fsm_shared_write(&powers, fsm_shared_read(&powers) + 1u);
}

static void *run_world(void *none)
{
    uint8_t warm[] = {1u};
    uint8_t temperature[] = {100u, 0u};
    for (int i = 0; i < COUNT; i++) {
        (void)fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, FSM_LINK_LEVELS, temperature, 2u);
        (void)fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, WARMED, warm, 1u);
        while ((uint32_t)i > (uint32_t)fsm_shared_read(&powers) + 100u) /* there is no overflow */
            pass(MILLISECOND / 10);
    }
    warm[0] = 200u;      /* out of range */
    temperature[1] = 99u; /* out of range */
    if (fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, WARMED, warm, 1u) ||
        fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, FSM_LINK_LEVELS, temperature, 2u) ||
        fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, WARMED, warm, 1000u))
        printf("taken\n");
    fsm_link_fan_restarted(&fan, OVEN_A_NODE_CAN);
    warm[0] = 2u;
    (void)fsm_link_fan_arrive(&fan, OVEN_A_NODE_CAN, WARMED, warm, 1u);
    return none;
}

int main(void)
{
    pthread_t world;
    uint32_t now = 0u;
    fsm_link_init(&wire, &oven_a_map, 7u);
    if (fsm_link_fan_open(&fan, &wire) != 0)
        return 1;
    fsm_link_fan_add(&fan, OVEN_A_NODE_CAN, translate, NULL);
    if (fsm_link_fan_start(&fan, 0) != 0 || fsm_link_connect(&wire, 10u) != FSM_LINK_READY)
        return 1;
    oven_a_init(&node);
    node.link = &wire;
    oven_a_start(&node, 0u);
    if (pthread_create(&world, NULL, run_world, NULL) != 0)
        return 1;
    while (fsm_shared_read(&powers) < COUNT + 1u && now < 20000u) {
        oven_a_cycle(&node, now++);
        pass(MILLISECOND / 20);
    }
    (void)pthread_join(world, NULL);
    fsm_link_fan_close(&fan);
    printf("powers %" PRIu32, (uint32_t)fsm_shared_read(&powers));
    for (int what = 0; what < FSM_LINK_COUNTS; what++)
        printf(" %" PRIu32, fsm_link_count(&wire, OVEN_A_NODE_CAN, (fsm_link_counter)what));
    printf(" malformed %" PRIu32 "\n", fsm_link_counted(&wire, FSM_LINK_MALFORMED));
    return 0;
}
