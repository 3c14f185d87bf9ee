/* burst_player.c: the node `b` of counting.py with a camera: send so many numbers and receive as many,
 * 1,000 cycles a second. */
#define _POSIX_C_SOURCE 200809L
#include "ping_b.h"
#include "ping_b_dds.h"

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>

enum { JUDGED = 1, LOOK = 2, EACH_CYCLE = 20, LONGEST = 60000 };

static fsm_link wire;
static fsm_link_fan fan;
static fsm_link_dds dds;

static void pass(void)
{
    (void)poll(NULL, 0u, 1);
}

static void wait_for_line(void)
{
    char line[16];
    if (fgets(line, sizeof line, stdin) == NULL)
        exit(1);
}

int main(int argc, char **argv)
{
    unsigned most = argc > 1 ? (unsigned)atoi(argv[1]) : 0u, sent = 0u, come = 0u, wrong = 0u;
    fsm_link_init(&wire, &ping_b_map, 1u);
    if (fsm_link_fan_open(&fan, &wire) != 0 ||
        fsm_link_dds_open(&dds, &fan, &ping_b_dds_other, 0) != 0 || fsm_link_fan_start(&fan, 0) != 0)
        return 1;
    while (fsm_link_dds_unheard(&dds) > 0u || fsm_link_dds_unserved(&dds) > 0u)
        pass();
    printf("ready\n");
    (void)fflush(stdout);
    wait_for_line();
    for (unsigned cycle = 0u; (come < most || fsm_link_dds_count(&dds, FSM_LINK_DDS_SENT) < most) &&
                              cycle < LONGEST;
         cycle++) {
        const fsm_link_frame *frame;
        unsigned room = fsm_link_dds_waiting(&dds) == 0u ? EACH_CYCLE : 0u;
        fsm_link_begin(&wire);
        for (; (frame = fsm_link_front(&wire)) != NULL; come++) {
            wrong += fsm_link_get_bytes(frame->bytes + FSM_LINK_HEADER, 2u) != come ? 1u : 0u;
            fsm_link_release(&wire);
        }
        for (; room > 0u && sent < most; room--, sent++) {
            uint8_t *p = fsm_link_claim(&wire, LOOK);
            if (p == NULL)
                break;
            fsm_link_put_bytes(p, sent, 2u);
            fsm_link_put(&wire);
        }
        (void)fsm_link_levels_out(&wire);
        fsm_link_end(&wire);
        pass();
    }
    printf("%u %u\n", come, wrong);
    (void)fflush(stdout);
    wait_for_line();
    fsm_link_fan_close(&fan);
    fsm_link_dds_close(&dds);
    return 0;
}
