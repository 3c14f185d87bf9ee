/* fsm_dds_diagnostics.c: see fsm_dds_diagnostics.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_dds_diagnostics.h"

#include "fsm_diagnostic_msgs.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

typedef diagnostic_msgs_msg_dds__KeyValue_ pair;
typedef diagnostic_msgs_msg_dds__DiagnosticStatus_ status;

enum { GOOD, WARNING, ERROR };
enum { PERIOD_MS = 1000 };
enum {
    COUNTERS = FSM_DDS_DIAGNOSTICS_COUNTERS,
    TEXT = FSM_DDS_DIAGNOSTICS_TEXT,
    STATUSES = FSM_LINK_NODES + FSM_DDS_DIAGNOSTICS_MACHINES
};

/* A message with the targets of its pointers. */
typedef struct {
    diagnostic_msgs_msg_dds__DiagnosticArray_ array;
    status statuses[STATUSES];
    pair pairs[FSM_LINK_NODES][COUNTERS + 1];
    char values[FSM_LINK_NODES][COUNTERS + 1][12];
    char names[STATUSES][TEXT];
    char messages[STATUSES][TEXT];
    char own[TEXT];
    char nothing[1];
} message;

static const char *const of_node[] = {"refused", "malformed", "foreign", "overruns"};
static const char *const of_peer[] = {"lost_frames", "lost_events", "missed",  "late",
                                      "doubled",     "overflow",    "restarts"};
static const fsm_link_counter peer_counters[] = {
    FSM_LINK_LOST_FRAMES, FSM_LINK_LOST_EVENTS, FSM_LINK_MISSED,  FSM_LINK_LATE,
    FSM_LINK_DOUBLED,     FSM_LINK_OVERFLOW,    FSM_LINK_RESTARTS};

static uint64_t now_ms(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

/* Append to a text of TEXT bytes, cut to its end. */
static void put(char *to, const char *text)
{
    size_t used = strlen(to);
    while (*text != '\0' && used + 1u < TEXT) {
        to[used++] = *text++;
    }
    to[used] = '\0';
}

static status *add_status(message *m, const char *of, const char *what)
{
    uint32_t place = m->array.status._length++;
    status *found = &m->statuses[place];
    put(m->names[place], m->own);
    put(m->names[place], of[0] != '\0' ? ": " : "");
    put(m->names[place], of);
    put(m->messages[place], what);
    found->name = m->names[place];
    found->message = m->messages[place];
    found->hardware_id = m->own;
    return found;
}

static void add_value(message *m, unsigned node, status *to, const char *key, uint32_t value)
{
    uint32_t place = to->values._length++;
    pair *found = &m->pairs[node][place];
    to->values._buffer = m->pairs[node];
    (void)snprintf(m->values[node][place], sizeof m->values[node][place], "%" PRIu32, value);
    found->key = (char *)(uintptr_t)key; /* which DDS only reads */
    found->value = m->values[node][place];
}

/* Add the counters of a node, and a warning if one has moved. */
static void add_counters(fsm_dds_diagnostics *d, message *m, unsigned node, status *to,
                         const char *const *keys, const uint32_t *values, unsigned count)
{
    for (unsigned place = 0u; place < count; place++) {
        add_value(m, node, to, keys[place], values[place]);
        if (values[place] != d->before[node][place]) {
            if (to->level == GOOD) {
                to->message[0] = '\0';
            }
            to->level = WARNING;
            put(to->message, to->message[0] == '\0' ? "moved: " : ", ");
            put(to->message, keys[place]);
        }
        d->before[node][place] = values[place];
    }
}

static void compose(fsm_dds_diagnostics *d, message *m, bool is_live)
{
    const fsm_link_map *map = d->link->map;
    const uint32_t own[] = {fsm_link_counted(d->link, FSM_LINK_REFUSED),
                            fsm_link_counted(d->link, FSM_LINK_MALFORMED),
                            fsm_link_counted(d->link, FSM_LINK_FOREIGN),
                            (uint32_t)fsm_shared_read(&d->overruns)};
    struct timespec now;
    status *node;
    memset(m, 0, sizeof *m);
    (void)clock_gettime(CLOCK_REALTIME, &now);
    m->array.header.stamp.sec = (int32_t)now.tv_sec;
    m->array.header.stamp.nanosec = (uint32_t)now.tv_nsec;
    m->array.header.frame_id = m->nothing;
    m->array.status._buffer = m->statuses;
    put(m->own, d->system);
    put(m->own, "/");
    put(m->own, map->names[map->node]);
    node = add_status(m, "", "no counter moved");
    add_counters(d, m, map->node, node, of_node, own, 4u);
    if (!is_live) {
        node->level = ERROR;
        (void)snprintf(node->message, TEXT, "no cycle completed for %" PRIu64 " ms",
                       d->watch.looked - d->watch.since);
    }
    for (uint8_t peer = 0u; peer < map->nodes; peer++) {
        uint32_t values[COUNTERS];
        status *found;
        if (peer == map->node) {
            continue;
        }
        for (unsigned place = 0u; place < sizeof of_peer / sizeof of_peer[0]; place++) {
            values[place] = fsm_link_count(d->link, peer, peer_counters[place]);
        }
        found = add_status(m, map->names[peer], "no counter moved");
        add_counters(d, m, peer, found, of_peer, values, sizeof of_peer / sizeof of_peer[0]);
        add_value(m, peer, found, "silence", (uint32_t)fsm_shared_read(&d->silence[peer]));
    }
    for (unsigned machine = 0u; machine < d->machine_count; machine++) {
        unsigned fault = (unsigned)fsm_shared_read(&d->fault[machine]);
        status *found = add_status(m, d->machines[machine], is_live ? "runs" : "the loop hangs");
        found->level = is_live ? GOOD : ERROR;
        if (fault != 0u) {
            found->level = ERROR;
            (void)snprintf(found->message, TEXT, "stopped by the fault %u", fault % 1000u);
        }
    }
}

static void *run(void *argument)
{
    fsm_dds_diagnostics *d = argument;
    uint64_t due = now_ms() + PERIOD_MS;
    dds_duration_t look;
    message m;
    fsm_link_watch(d->link, &d->watch, now_ms());
    look = (dds_duration_t)fsm_watch_every(&d->watch);
    look = DDS_MSECS(look < PERIOD_MS ? look : PERIOD_MS);
    while (dds_waitset_wait(d->waitset, NULL, 0u, look) == 0) {
        uint64_t now = now_ms();
        bool is_live = fsm_link_is_live(d->link, &d->watch, now);
        if (now >= due) {
            due = now + PERIOD_MS;
            compose(d, &m, is_live);
            (void)dds_write(d->writer, &m.array);
        }
    }
    return NULL;
}

static int join(fsm_dds_diagnostics *d, const fsm_dds_domain *domain)
{
    dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1;
    dds_entity_t topic;
    dds_qos_t *qos;
    d->participant = fsm_dds_join(domain);
    if (d->participant < 0) {
        return d->participant;
    }
    qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    dds_qset_data_representation(qos, 1u, &plain);
    topic = dds_create_topic(d->participant, &diagnostic_msgs_msg_dds__DiagnosticArray__desc,
                             "rt/diagnostics", NULL, NULL);
    d->writer = topic > 0 ? dds_create_writer(d->participant, topic, qos, NULL) : topic;
    dds_delete_qos(qos);
    d->stop = dds_create_guardcondition(d->participant);
    d->waitset = dds_create_waitset(d->participant);
    if (d->writer < 0) {
        return d->writer;
    }
    return d->waitset > 0 ? dds_waitset_attach(d->waitset, d->stop, 0) : d->waitset;
}

int fsm_dds_diagnostics_open(fsm_dds_diagnostics *d, const fsm_link *link,
                             const fsm_dds_domain *domain, const char *system,
                             const char *const *machines, unsigned count)
{
    int error;
    memset(d, 0, sizeof *d);
    d->link = link;
    d->system = system;
    d->machines = machines;
    d->machine_count = count;
    if (count > FSM_DDS_DIAGNOSTICS_MACHINES) {
        return E2BIG;
    }
    error = join(d, domain);
    if (error == 0) {
        error = pthread_create(&d->thread, NULL, run, d);
        d->has_thread = error == 0;
    }
    if (error != 0) {
        fsm_dds_diagnostics_close(d);
    }
    return error;
}

void fsm_dds_diagnostics_note(fsm_dds_diagnostics *d, unsigned machine, unsigned fault)
{
    for (uint8_t peer = 0u; peer < d->link->map->nodes; peer++) {
        fsm_shared_write(&d->silence[peer], (FSM_INDEX)fsm_link_silence(d->link, peer));
    }
    if (machine < d->machine_count) {
        fsm_shared_write(&d->fault[machine], (FSM_INDEX)fault);
    }
}

void fsm_dds_diagnostics_overran(fsm_dds_diagnostics *d, uint32_t overruns)
{
    fsm_shared_write(&d->overruns, (FSM_INDEX)overruns);
}

void fsm_dds_diagnostics_close(fsm_dds_diagnostics *d)
{
    if (d->has_thread) {
        (void)dds_set_guardcondition(d->stop, true);
        (void)pthread_join(d->thread, NULL);
        d->has_thread = false;
    }
    fsm_dds_leave(d->participant);
    d->participant = 0;
}
