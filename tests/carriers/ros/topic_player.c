/* topic_player.c: the node `b` of test_c_carrier.py, 1,000 cycles a second.
 *
 * topic_player exchange COUNT   send so many events, receive as many, print what came
 * topic_player obey             do what lines of the input say, until it ends */
#define _POSIX_C_SOURCE 200809L
#include "cell_b.h"
#include "cell_b_dds.h"
#include "fsm_link_dds.h"

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { JUDGED = 1, LOOK = 2, EACH_CYCLE = 20 };

static fsm_link wire;
static fsm_link_fan fan;
static fsm_link_dds dds;
static cell_b node;

static uint32_t count(fsm_link_counter what)
{
    return fsm_link_count(&wire, CELL_B_NODE_VISION, what);
}

static void say_counts(void)
{
    printf("light %d sharp %d restarts %" PRIu32 " silence %" PRIu32 " lost %" PRIu32,
           (int)node.camera.in.light, node.camera.in.is_sharp ? 1 : 0, count(FSM_LINK_RESTARTS),
           fsm_link_silence(&wire, CELL_B_NODE_VISION), count(FSM_LINK_LOST_EVENTS));
    printf(" malformed %" PRIu32 " late %" PRIu32 " sent %" PRIu32 " unsent %" PRIu32
           " seen %d overflow %" PRIu32 "\n",
           fsm_link_counted(&wire, FSM_LINK_MALFORMED), fsm_link_dds_count(&dds, FSM_LINK_DDS_LATE),
           fsm_link_dds_count(&dds, FSM_LINK_DDS_SENT),
           fsm_link_dds_count(&dds, FSM_LINK_DDS_UNSENT), (int)node.camera.data.seen,
           count(FSM_LINK_OVERFLOW));
}

static void pass(void)
{
    struct pollfd none = {-1, 0, 0};
    (void)poll(&none, 1u, 1);
}

static void levels(void)
{
    uint8_t *p = fsm_link_levels_out(&wire);
    if (p != NULL)
        memset(p, 0, 8u);
}

static void exchange(unsigned most)
{
    unsigned sent = 0u, come = 0u, wrong = 0u;
    unsigned cycles;
    char line[16];
    if (fgets(line, sizeof line, stdin) == NULL)
        return;
    for (cycles = 0u; (come < most || sent < most) && cycles < 60000u; cycles++) {
        const fsm_link_frame *frame;
        unsigned room = fsm_link_dds_waiting(&dds) == 0u ? EACH_CYCLE : 0u;
        fsm_link_begin(&wire);
        while ((frame = fsm_link_front(&wire)) != NULL) {
            wrong += frame->bytes[FSM_LINK_HEADER + 1u] != come % 251u ? 1u : 0u;
            come++;
            fsm_link_release(&wire);
        }
        for (unsigned some = 0u; some < room && sent < most; some++) {
            uint8_t *p = fsm_link_claim(&wire, LOOK);
            if (p == NULL)
                break;
            p[0] = 1u;
            fsm_link_put(&wire);
            sent++;
        }
        levels();
        fsm_link_end(&wire);
        pass();
    }
    for (cycles = 0u; cycles < 500u; cycles++) { /* what is in the rings goes out */
        fsm_link_begin(&wire);
        levels();
        fsm_link_end(&wire);
        pass();
    }
    printf("came %u wrong %u refused %" PRIu32 " ", come, wrong,
           fsm_link_counted(&wire, FSM_LINK_REFUSED));
    say_counts();
}

static void obey(void)
{
    char input[4096];
    size_t used = 0u;
    struct pollfd in = {0, POLLIN, 0};
    uint32_t now = 0u;
    for (;;) {
        char *end;
        while (poll(&in, 1u, 1) == 0) {
            cell_b_cycle(&node, now++);
            fsm_link_dds_show(&dds, CELL_B_DDS_VISION_CAMERA,
                              camera_state_name((camera_state)node.camera.fsm.active));
        }
        {
            ssize_t more = read(0, input + used, sizeof input - used);
            if (more <= 0)
                return;
            used += (size_t)more;
        }
        while ((end = memchr(input, '\n', used)) != NULL) {
            *end = '\0';
            if (strncmp(input, "position ", 9u) == 0)
                node.belt.out.position = (int32_t)atoi(input + 9);
            else
                say_counts();
            used -= (size_t)(end + 1 - input);
            memmove(input, end + 1, used);
        }
    }
}

int main(int argc, char **argv)
{
    int error;
    setvbuf(stdout, NULL, _IOLBF, 0u);
    fsm_link_init(&wire, &cell_b_map, 7u);
    if (argc < 2 || fsm_link_fan_open(&fan, &wire) != 0)
        return 1;
    error = fsm_link_dds_open(&dds, &fan, &cell_b_dds_vision, 0);
    if (error != 0) {
        printf("error %d %s\n", error, error < 0 ? dds_strretcode(-error) : "");
        return 1;
    }
    if (fsm_link_fan_start(&fan, 0) != 0)
        return 1;
    cell_b_init(&node);
    node.link = &wire;
    cell_b_start(&node, 0u);
    while (strcmp(argv[1], "exchange") == 0 && /* levels have no other end there */
           (fsm_link_dds_unheard(&dds) > 2u || fsm_link_dds_unserved(&dds) > 2u))
        pass();
    printf("ready\n");
    if (strcmp(argv[1], "exchange") == 0)
        exchange((unsigned)atoi(argv[2]));
    else
        obey();
    fsm_link_fan_close(&fan);
    fsm_link_dds_close(&dds);
    return 0;
}
