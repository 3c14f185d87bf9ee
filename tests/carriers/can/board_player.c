/* board_player.c: a board of the cell on a CAN bus (BOARD_NET), or with links by topics of ROS
 * (BOARD_ROS), in cycles of 1 ms, until the standard input ends. It writes how many modules have failed
 * when that changes, and for how many cycles the other board was silent then; at the end its notes, and
 * what was counted. */
#define _POSIX_C_SOURCE 200809L
#include "board.h"
#ifdef BOARD_ROS
#include "fsm_link_ros.h"
#else
#include "fsm_link_net.h"
#endif
#include BOARD_TABLES

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static fsm_link wire;
static board it;

#ifdef BOARD_ROS
static fsm_link_ros carrier;

static int open_carrier(const char *bus)
{
    (void)bus; /* the domain is in the tables */
    return fsm_link_ros_open(&carrier, &wire, &BOARD_ROS, 0);
}

static void close_carrier(void)
{
    fsm_link_ros_close(&carrier);
}
#else
static fsm_link_net carrier;

static int open_carrier(const char *bus)
{
    return fsm_link_net_open(&carrier, &wire, &BOARD_NET, bus);
}

static void close_carrier(void)
{
    fsm_link_net_close(&carrier);
}
#endif

static void set(const char *name, int32_t value)
{
    for (size_t i = 0; i < board_this.wire_count; i++)
        if (strcmp(board_this.wires[i].name, name) == 0)
            *fsm_io_at(board_this.raw, &board_this.wires[i]) = value;
}

/* How many modules are in their state `error`, in which nothing moves. */
static unsigned failed(void)
{
    unsigned count = 0u;
    for (size_t i = 0; i < board_this.machine_count; i++) {
        const board_machine *const m = &board_this.machines[i];
        count += strcmp(m->state_name(m->leaf()), "error") == 0 ? 1u : 0u;
    }
    return count;
}

int main(int argc, char **argv)
{
    struct pollfd end = {0, POLLIN, 0};
    const uint8_t peer = (uint8_t)(1u - board_this.node);
    uint32_t now = 1u;
    unsigned before = 0u;
    if (argc != 3)
        return 1;
    fsm_link_init(&wire, board_this.map, (uint32_t)strtoul(argv[2], NULL, 10));
    if (open_carrier(argv[1]) != 0)
        return 1;
    board_make(&it, &wire, true);
    set("power", 1);
    printf("ready\n");
    (void)fflush(stdout);
    while (poll(&end, 1u, 1) == 0) {
        board_step(&it, now++);
        if (failed() != before) {
            before = failed();
            printf("%" PRIu32 " failed %u silence %" PRIu32 "\n", now, before,
                   fsm_link_silence(&wire, peer));
            (void)fflush(stdout);
        }
    }
    for (uint32_t i = 0; i < it.note_count && i < BOARD_NOTES; i++)
        printf("note %" PRIu32 " %s\n", it.notes[i].at, it.notes[i].text);
    for (int what = 0; what < FSM_LINK_COUNTS; what++)
        printf("%" PRIu32 " ", fsm_link_count(&wire, peer, (fsm_link_counter)what));
    for (int what = 0; what < FSM_LINK_TOTALS; what++)
        printf("%" PRIu32 " ", fsm_link_counted(&wire, (fsm_link_total)what));
    printf("\n");
    close_carrier();
    return 0;
}
