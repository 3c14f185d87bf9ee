/* fsm_link_dds.h: a foreign node of ROS 2: its topics as events and levels of a link, by Cyclone DDS.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   fsm_link_fan_open(&fan, &link);
 *   fsm_link_dds_open(&dds, &fan, &cell_b_dds_vision, 0);           the tables of cell_b_dds.h
 *   fsm_link_fan_start(&fan, 0);                                    and the loop (fsm_link_fan.h)
 *   ...
 *   fsm_link_fan_close(&fan);
 *   fsm_link_dds_close(&dds);
 *
 * Events are published as they leave, levels when they change (those of sensors each time). A thread
 * receives; of events it takes no more than the link has room for, the others stay with DDS, which
 * lets their publishers wait. A message with a value out of its range counts as malformed, a gap in
 * the numbers of a program as lost, another program on a topic starts a session.
 *
 * DDS allocates memory and waits for locks of its own. All calls of it are made by that thread, by
 * the one that takes frames out of the link, and by those who call the functions below that say so;
 * none by the loop. POSIX, Cyclone DDS 0.10: -pthread -lddsc. */
#ifndef FSM_LINK_DDS_H
#define FSM_LINK_DDS_H

#include "fsm_dds_domain.h"
#include "fsm_link_fan.h"
#include "fsm_ros_values.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_LINK_DDS_TOPICS /* of a foreign node, in both directions */
#define FSM_LINK_DDS_TOPICS 32
#endif
#ifndef FSM_LINK_DDS_MACHINES /* of this node, whose active states are shown */
#define FSM_LINK_DDS_MACHINES 16
#endif
#ifndef FSM_LINK_DDS_WAITING /* events of a topic that wait here when DDS takes no more */
#define FSM_LINK_DDS_WAITING FSM_LINK_SLOTS
#endif
#ifndef FSM_LINK_DDS_PROGRAMS /* programs of which a topic is remembered, to distinguish a new one */
#define FSM_LINK_DDS_PROGRAMS 32
#endif
#ifndef FSM_LINK_DDS_TEXT /* bytes of the active states of a machine, with the zero */
#define FSM_LINK_DDS_TEXT 128
#endif

/* ---- tables; generated ------------------------------------------------------------------------ */

typedef struct {
    const char *name; /* in DDS, with `rt` before it */
    const dds_topic_descriptor_t *type;
    fsm_ros_qos qos;
    bool is_event;
    bool is_sent;    /* by this node */
    bool is_counted; /* its messages have fsm_ros_numbers */
} fsm_link_dds_topic;

/* A connection. A topic may have several. */
typedef struct {
    uint16_t topic;   /* by its place */
    uint16_t message; /* of the event map, or FSM_LINK_LEVELS */
    uint16_t at, size; /* of a level, in the payload with all of its sender */
    /* Incoming: write values into a payload and the numbers, if the message has them; false
     * if a value has no place in the payload. For levels, the payload has all of the sender. */
    bool (*unpack)(const void *sample, uint8_t *p, fsm_ros_numbers *numbers);
    /* Outgoing: publish a message with the values of a payload. */
    dds_return_t (*publish)(dds_entity_t writer, const uint8_t *p,
                            const fsm_ros_numbers *numbers);
} fsm_link_dds_wire;

/* The messages between a node and an external one. */
typedef struct {
    uint8_t peer; /* the foreign node, by its place in the deployment */
    uint32_t domain;
    bool is_insecure;     /* its programs may run on other computers (fsm_dds_domain.h) */
    uint16_t levels;      /* bytes of its levels */
    const uint8_t *start; /* its levels, until messages with them come */
    uint16_t topic_count, wire_count, machine_count;
    const fsm_link_dds_topic *topic;
    const fsm_link_dds_wire *wire;
    const char *const *machine; /* topics with the active states of machines */
    const dds_topic_descriptor_t *text;
    dds_return_t (*publish_text)(dds_entity_t writer, char *text);
} fsm_link_dds_node;

/* ---- a translator ----------------------------------------------------------------------------- */

typedef enum {
    FSM_LINK_DDS_RECEIVED, /* messages that came */
    FSM_LINK_DDS_SENT,     /* messages that DDS took */
    FSM_LINK_DDS_UNSENT,   /* events for which there was no room, as a subscriber has not read */
    FSM_LINK_DDS_REFUSED,  /* messages with a value out of its range */
    FSM_LINK_DDS_LATE,     /* messages whose own number had come already: dropped */
    FSM_LINK_DDS_COUNTS
} fsm_link_dds_counter;

typedef struct {
    uint16_t wire;
    fsm_ros_numbers numbers;
    uint8_t payload[FSM_LINK_BYTES - FSM_LINK_HEADER];
} fsm_link_dds_event;

typedef struct {
    dds_instance_handle_t writer;
    dds_guid_t program;
    uint32_t session, next;
} fsm_link_dds_program;

/* The state of a topic. */
typedef struct {
    dds_entity_t end; /* its reader, or its writer */
    /* received; the thread's own */
    void *held; /* the oldest message, on loan from DDS; NULL: no message */
    dds_time_t stamp;
    dds_instance_handle_t writer; /* of that message */
    uint16_t wires;
    fsm_link_dds_program programs[FSM_LINK_DDS_PROGRAMS];
    uint32_t known; /* programs so far */
    /* sent; guarded */
    uint32_t sequence;
    uint32_t put, got; /* of those that wait */
    fsm_link_dds_event waiting[FSM_LINK_DDS_WAITING];
} fsm_link_dds_end;

typedef struct {
    dds_entity_t writer;
    fsm_shared is_new; /* the loop writes `text` while it is 0, the thread that sends reads it then */
    char text[FSM_LINK_DDS_TEXT];
    char last[FSM_LINK_DDS_TEXT]; /* what was shown last; the loop's own */
} fsm_link_dds_shown;

typedef struct {
    const fsm_link_dds_node *node;
    fsm_link_fan *fan;
    dds_entity_t participant, wake, waitset;
    pthread_t thread;
    pthread_mutex_t turn; /* of the thread and of the one that sends */
    fsm_shared stop;
    bool has_turn, has_thread;
    fsm_shared counts[FSM_LINK_DDS_COUNTS]; /* the thread's own: RECEIVED, REFUSED, LATE */
    fsm_shared waits; /* events of all topics that wait */
    uint8_t levels[FSM_LINK_BYTES]; /* of the foreign node; the thread's own */
    uint8_t own[FSM_LINK_BYTES];    /* levels of this node as they were published */
    bool is_published[FSM_LINK_DDS_TOPICS];
    struct {
        dds_guid_t program;
        uint32_t session;
    } runs[FSM_LINK_DDS_PROGRAMS]; /* that started a session */
    uint32_t begun;
    fsm_link_dds_end ends[FSM_LINK_DDS_TOPICS];
    fsm_link_dds_shown shown[FSM_LINK_DDS_MACHINES];
} fsm_link_dds;

/* Join a foreign node to a fan that is not started yet; the thread that receives and those of DDS have
 * this SCHED_FIFO priority if it is not 0. 0, an errno, or a code of DDS, which is negative
 * (fsm_dds_join, dds_strretcode). Calls DDS. */
int fsm_link_dds_open(fsm_link_dds *dds, fsm_link_fan *fan, const fsm_link_dds_node *node,
                      int priority);

/* The loop: let the active states of a machine, by its place in the table, be published with the next
 * frame that leaves. Makes no call. A text that is too long is cut. */
void fsm_link_dds_show(fsm_link_dds *dds, unsigned machine, const char *text);

uint32_t fsm_link_dds_count(const fsm_link_dds *dds, fsm_link_dds_counter what);

/* Return the number of events that wait until subscribers have read others. A loop that sends less while
 * events wait loses none. Makes no call of DDS. */
uint32_t fsm_link_dds_waiting(const fsm_link_dds *dds);

/* Return the number of published topics without a subscriber: events on them are lost. Calls DDS. */
unsigned fsm_link_dds_unheard(const fsm_link_dds *dds);

/* Return the number of subscribed topics without a publisher that this node knows. A publisher may discover
 * this node earlier; an event that it publishes in between is lost. Calls DDS. */
unsigned fsm_link_dds_unserved(const fsm_link_dds *dds);

/* Leave the domain; after the fan is closed. Calls DDS. */
void fsm_link_dds_close(fsm_link_dds *dds);

#ifdef __cplusplus
}
#endif

#endif
