/* frames_player.c: the node `a` of `between` in counting.py: send so many numbers and receive as many, 1,000
 * cycles a second; then go on, and answer each line by what is counted of the node `b`. */
#define _POSIX_C_SOURCE 200809L
#include "ping_a.h"
#include "ping_a_dds.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>

enum { LOOK = 2, EACH_CYCLE = 20 };

static fsm_link wire;
static fsm_link_ros ros;
static unsigned most, sent, come, wrong;

static void cycle(void)
{
    const fsm_link_frame *frame;
    fsm_link_begin(&wire);
    for (; (frame = fsm_link_front(&wire)) != NULL; come++) {
        wrong += fsm_link_get_bytes(frame->bytes + FSM_LINK_HEADER, 2u) != come % 60000u ? 1u : 0u;
        fsm_link_release(&wire);
    }
    for (unsigned room = EACH_CYCLE; room > 0u && sent < most && sent < come + 200u; room--, sent++) {
        uint8_t *p = fsm_link_claim(&wire, LOOK);
        if (p == NULL)
            break;
        fsm_link_put_bytes(p, sent % 60000u, 2u);
        fsm_link_put(&wire);
    }
    (void)fsm_link_levels_out(&wire);
    fsm_link_end(&wire);
}

static unsigned counted(fsm_link_counter what)
{
    return (unsigned)fsm_link_count(&wire, PING_A_NODE_B, what);
}

int main(int argc, char **argv)
{
    struct pollfd in = {0, POLLIN, 0};
    char line[160];
    int error;
    if (argc != 4)
        return 2;
    most = (unsigned)atoi(argv[1]);
    fsm_link_init(&wire, &ping_a_map, (uint32_t)atoi(argv[2]));
    error = fsm_link_ros_open(&ros, &wire, &ping_a_ros, atoi(argv[3]));
    if (error != 0) {
        printf("error %d\n", error);
        return 1;
    }
    if (fsm_link_connect(&wire, 20000u) != FSM_LINK_READY) {
        fsm_link_explain(&wire, line, sizeof line);
        puts(line);
        return 1;
    }
    if (fsm_link_connect_to(&wire, PING_A_NODE_B, 99u, 50u) != FSM_LINK_TIMEOUT)
        return 3; /* there is no such session */
    puts("ready");
    (void)fflush(stdout);
    for (;;) {
        cycle();
        if (poll(&in, 1u, 1) <= 0)
            continue;
        if (fgets(line, sizeof line, stdin) == NULL)
            break;
        printf("come %u wrong %u lost %u missed %u doubled %u overflow %u restarts %u silence %u "
               "malformed %u foreign %u unsent %u\n",
               come, wrong, counted(FSM_LINK_LOST_FRAMES), counted(FSM_LINK_MISSED),
               counted(FSM_LINK_DOUBLED), counted(FSM_LINK_OVERFLOW), counted(FSM_LINK_RESTARTS),
               (unsigned)fsm_link_silence(&wire, PING_A_NODE_B),
               (unsigned)fsm_link_counted(&wire, FSM_LINK_MALFORMED),
               (unsigned)fsm_link_counted(&wire, FSM_LINK_FOREIGN),
               (unsigned)fsm_link_ros_count(&ros, FSM_LINK_ROS_UNSENT));
        (void)fflush(stdout);
    }
    fsm_link_ros_close(&ros);
    return 0;
}
