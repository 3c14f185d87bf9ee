/* press.c: the node `press` in C: CAN, ROS 2 and ZeroMQ on one link, and a record of all that changes.
 *
 *   press SECONDS LOSS SEED BUS RECORD          LOSS in 1/65536; BUS as of fsm_link_can.h
 *
 * A line of the record is what node.py writes: the time (ns, CLOCK_MONOTONIC), the machine, its active
 * states, its data and its inputs. The loop makes no call on a carrier; each has threads of its own. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link_can.h"
#include "fsm_link_zmq.h"
#include "line_press.h"
#include "line_press_can.h"
#include "line_press_dds.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PERIOD_NS 1000000
#define LINE 256 /* characters; states have few digits */

static fsm_link wire; /* large: not on the stack */
static fsm_link_fan fan;
static fsm_link_zmq zmq;
static fsm_link_can can;
static fsm_link_dds topics;
static fsm_link_faults faults;
static line_press node;

static int64_t monotonic(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static bool is_molder_in(unsigned state)
{
    return molder_in(&node.molder, (molder_state)state);
}

static bool is_camera_in(unsigned state)
{
    return camera_in(&node.camera, (camera_state)state);
}

/* Write the line of a machine if it is not the one before; the rest: its data and its inputs. */
static void record(FILE *out, int64_t now, const char *machine, bool (*is_in)(unsigned), unsigned states,
                   const char *rest, char *before)
{
    char line[LINE];
    int length = snprintf(line, sizeof line, "\"%s\", [", machine);
    const char *comma = "";
    for (unsigned state = 0u; state < states; state++) {
        if (is_in(state)) {
            length += snprintf(line + length, sizeof line - (size_t)length, "%s%u", comma, state);
            comma = ", ";
        }
    }
    (void)snprintf(line + length, sizeof line - (size_t)length, "], %s", rest);
    if (strcmp(line, before) != 0) {
        (void)memcpy(before, line, sizeof line);
        fprintf(out, "[%" PRId64 ", %s]\n", now, line);
    }
}

static void record_all(FILE *out, int64_t now)
{
    static char molder_before[LINE];
    static char camera_before[LINE];
    char rest[64];
    (void)snprintf(rest, sizeof rest, "[%u], [%d]", (unsigned)node.molder.data.number,
                   (int)node.molder.in.temperature);
    record(out, now, "molder", is_molder_in, MOLDER_STATES, rest, molder_before);
    (void)snprintf(rest, sizeof rest, "[%u], []", (unsigned)node.camera.data.number);
    record(out, now, "camera", is_camera_in, CAMERA_STATES, rest, camera_before);
}

static int opened(const char *bus)
{
    fsm_link_zmq_options options;
    memset(&options, 0, sizeof options);
    options.endpoints = line_press_endpoints;
    if (fsm_link_fan_open(&fan, &wire) != 0) {
        fputs("there is no fan\n", stderr);
        return 1;
    }
    if (fsm_link_can_open(&can, &fan, &line_press_can_heater, bus) != 0) {
        fprintf(stderr, "cannot open the bus %s\n", bus);
        return 1;
    }
    if (fsm_link_dds_open(&topics, &fan, &line_press_dds_vision, 0) != 0) {
        fputs("cannot open the topics\n", stderr);
        return 1;
    }
    if (fsm_link_zmq_open(&zmq, &wire, &options) != 0) {
        fprintf(stderr, "cannot open %s\n", zmq.failed);
        return 1;
    }
    return fsm_link_fan_start(&fan, 0);
}

static void tell(uint8_t peer, const char *name, const char *end)
{
    printf("\"%s\": {\"restarts\": %u, \"lost events\": %u}%s", name,
           (unsigned)fsm_link_count(&wire, peer, FSM_LINK_RESTARTS),
           (unsigned)fsm_link_count(&wire, peer, FSM_LINK_LOST_EVENTS), end);
}

int main(int argc, char **argv)
{
    int64_t begin, end, due;
    FILE *out;
    if (argc != 6) {
        fputs("press SECONDS LOSS SEED BUS RECORD\n", stderr);
        return 2;
    }
    out = fopen(argv[5], "w");
    if (out == NULL) {
        perror(argv[5]);
        return 1;
    }
    fsm_link_init(&wire, &line_press_map, (uint32_t)time(NULL));
    faults.loss = (uint32_t)strtoul(argv[2], NULL, 10);
    faults.seed = strtoull(argv[3], NULL, 10);
    fsm_link_set_faults(&wire, &faults);
    if (opened(argv[4]) != 0) {
        return 1;
    }
    line_press_init(&node);
    node.link = &wire;
    line_press_start(&node, 0u);
    begin = due = monotonic();
    end = begin + (int64_t)(strtod(argv[1], NULL) * 1e9);
    for (int64_t now = begin; now < end; now = monotonic()) {
        struct timespec wake;
        line_press_cycle(&node, (uint32_t)((now - begin) / PERIOD_NS));
        record_all(out, now);
        due = due + PERIOD_NS > now ? due + PERIOD_NS : now;
        wake.tv_sec = (time_t)(due / 1000000000);
        wake.tv_nsec = (long)(due % 1000000000);
        (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL);
    }
    printf("{\"node\": \"press, in C\", \"dropped\": %u, \"peers\": {", (unsigned)faults.lost);
    tell(LINE_PRESS_NODE_SUPPLY, "supply", ", ");
    tell(LINE_PRESS_NODE_HEATER, "heater", ", ");
    tell(LINE_PRESS_NODE_VISION, "vision", "}}\n");
    fsm_link_zmq_close(&zmq);
    fsm_link_fan_close(&fan);
    fsm_link_can_close(&can);
    fsm_link_dds_close(&topics);
    return fclose(out) == 0 ? 0 : 1;
}
