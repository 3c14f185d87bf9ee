/* fsm_link_dds.c: see fsm_link_dds.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_dds.h"

#include <errno.h>
#include <sched.h>
#include <string.h>

enum { SESSION = 8, EVENTS = 16 }; /* offsets in a frame: docs/reference/links.md */
enum { BURST = 256 };              /* messages of a topic before others have their turn */
#define RETRY DDS_MSECS(1)         /* when a ring is full, here or in DDS */

static void add(fsm_link_dds *dds, fsm_link_dds_counter what)
{
    fsm_shared_write(&dds->counts[what], (FSM_INDEX)(fsm_shared_own(&dds->counts[what]) + 1u));
}

/* ---- to the topics ---------------------------------------------------------------------------- */

static dds_return_t publish(fsm_link_dds *dds, const fsm_link_dds_wire *wire, const uint8_t *payload,
                            const fsm_ros_numbers *numbers)
{
    dds_return_t code = wire->publish(dds->ends[wire->topic].end, payload, numbers);
    if (code == DDS_RETCODE_OK) {
        add(dds, FSM_LINK_DDS_SENT);
    }
    return code;
}

/* Publish waiting events until DDS accepts no more; return whether none is left. */
static bool flush(fsm_link_dds *dds, fsm_link_dds_end *end)
{
    while (end->got != end->put) {
        const fsm_link_dds_event *event = &end->waiting[end->got % FSM_LINK_DDS_WAITING];
        if (publish(dds, &dds->node->wire[event->wire], event->payload, &event->numbers) !=
            DDS_RETCODE_OK) {
            return false;
        }
        end->got++;
        fsm_shared_write(&dds->waits, (FSM_INDEX)(fsm_shared_own(&dds->waits) - 1u));
    }
    return true;
}

static bool flush_all(fsm_link_dds *dds)
{
    bool is_all = true;
    (void)pthread_mutex_lock(&dds->turn);
    for (unsigned topic = 0u; topic < dds->node->topic_count; topic++) {
        is_all = flush(dds, &dds->ends[topic]) && is_all;
    }
    (void)pthread_mutex_unlock(&dds->turn);
    return is_all;
}

static void send_event(fsm_link_dds *dds, uint16_t place, const fsm_link_frame *frame)
{
    const fsm_link_dds_wire *wire = &dds->node->wire[place];
    fsm_link_dds_end *end = &dds->ends[wire->topic];
    fsm_link_dds_event *event;
    fsm_ros_numbers numbers = {(uint32_t)fsm_link_get_bytes(frame->bytes + SESSION, 4u),
                                    end->sequence,
                                    (uint32_t)fsm_link_get_bytes(frame->bytes + EVENTS, 4u)};
    const uint8_t *payload = frame->bytes + FSM_LINK_HEADER;
    end->sequence++; /* also of one that is not sent: its subscribers see the gap */
    if (flush(dds, end) && publish(dds, wire, payload, &numbers) == DDS_RETCODE_OK) {
        return;
    }
    if (end->put - end->got == FSM_LINK_DDS_WAITING) {
        add(dds, FSM_LINK_DDS_UNSENT);
        return;
    }
    event = &end->waiting[end->put % FSM_LINK_DDS_WAITING];
    event->wire = place;
    event->numbers = numbers;
    memcpy(event->payload, payload, (size_t)frame->length - FSM_LINK_HEADER);
    if (end->put == end->got) {
        (void)dds_set_guardcondition(dds->wake, true); /* the thread tries again */
    }
    end->put++;
    fsm_shared_write(&dds->waits, (FSM_INDEX)(fsm_shared_own(&dds->waits) + 1u));
}

/* Publish a level if it has changed. What DDS does not take is tried again with the next levels. */
static void send_level(fsm_link_dds *dds, const fsm_link_dds_wire *wire, const uint8_t *payload)
{
    static const fsm_ros_numbers none = {0u, 0u, 0u};
    bool *is_published = &dds->is_published[wire->topic];
    bool is_same = memcmp(dds->own + wire->at, payload + wire->at, wire->size) == 0;
    if (*is_published && is_same && dds->node->topic[wire->topic].qos != FSM_ROS_SENSOR) {
        return;
    }
    *is_published = publish(dds, wire, payload, &none) == DDS_RETCODE_OK;
    memcpy(dds->own + wire->at, payload + wire->at, wire->size);
}

static void send_shown(fsm_link_dds *dds)
{
    for (unsigned machine = 0u; machine < dds->node->machine_count; machine++) {
        fsm_link_dds_shown *shown = &dds->shown[machine];
        if (fsm_shared_read(&shown->is_new) != 0u &&
            dds->node->publish_text(shown->writer, shown->text) == DDS_RETCODE_OK) {
            add(dds, FSM_LINK_DDS_SENT);
            fsm_shared_write(&shown->is_new, 0u);
        }
    }
}

/* In the thread that takes frames out of the link. */
static void take(void *translator, const fsm_link_frame *frame)
{
    fsm_link_dds *dds = translator;
    uint16_t message = fsm_link_message_of(frame);
    (void)pthread_mutex_lock(&dds->turn);
    for (uint16_t place = 0u; place < dds->node->wire_count; place++) {
        const fsm_link_dds_wire *wire = &dds->node->wire[place];
        if (wire->publish == NULL || wire->message != message) {
            continue;
        }
        if (message == FSM_LINK_LEVELS) {
            send_level(dds, wire, frame->bytes + FSM_LINK_HEADER);
        } else {
            send_event(dds, place, frame);
        }
    }
    send_shown(dds);
    (void)pthread_mutex_unlock(&dds->turn);
}

void fsm_link_dds_show(fsm_link_dds *dds, unsigned machine, const char *text)
{
    fsm_link_dds_shown *shown = &dds->shown[machine];
    if (machine >= dds->node->machine_count || fsm_shared_read(&shown->is_new) != 0u ||
        strncmp(shown->last, text, sizeof shown->last - 1u) == 0) {
        return; /* what is waiting goes first; the next call comes in the next cycle */
    }
    for (size_t at = 0u; at + 1u < sizeof shown->text; at++) {
        shown->last[at] = shown->text[at] = *text;
        text += *text != '\0' ? 1 : 0;
    }
    fsm_shared_write(&shown->is_new, 1u);
}

/* ---- from the topics -------------------------------------------------------------------------- */

static bool is_same(const dds_guid_t *one, const dds_guid_t *other)
{
    return memcmp(one->v, other->v, sizeof one->v) == 0;
}

/* Who has published the message that is held: a participant, or if it has gone already, a writer. */
static dds_guid_t program_of(const fsm_link_dds_end *end)
{
    dds_guid_t found;
    dds_builtintopic_endpoint_t *data;
    uint32_t known = end->known < FSM_LINK_DDS_PROGRAMS ? end->known : FSM_LINK_DDS_PROGRAMS;
    for (uint32_t place = 0u; place < known; place++) {
        if (end->programs[place].writer == end->writer) {
            return end->programs[place].program;
        }
    }
    memset(&found, 0, sizeof found);
    data = dds_get_matched_publication_data(end->end, end->writer);
    if (data != NULL) {
        found = data->participant_key;
        dds_builtintopic_free_endpoint(data);
    } else {
        memcpy(found.v, &end->writer, sizeof end->writer);
    }
    return found;
}

/* Start a session for another run of the foreign node, once for all its topics. */
static void begin(fsm_link_dds *dds, const dds_guid_t *program, uint32_t session)
{
    uint32_t known = dds->begun < FSM_LINK_DDS_PROGRAMS ? dds->begun : FSM_LINK_DDS_PROGRAMS;
    uint32_t place = dds->begun % FSM_LINK_DDS_PROGRAMS;
    for (uint32_t run = 0u; run < known; run++) {
        if (is_same(&dds->runs[run].program, program) && dds->runs[run].session == session) {
            return;
        }
    }
    dds->runs[place].program = *program;
    dds->runs[place].session = session;
    dds->begun++;
    fsm_link_fan_restarted(dds->fan, dds->node->peer);
}

/* Whether a message is in order; count gaps, start a session for a new program, and for
 * one with another session. */
static bool is_next(fsm_link_dds *dds, fsm_link_dds_end *end, bool is_counted,
                    const fsm_ros_numbers *numbers)
{
    uint32_t known = end->known < FSM_LINK_DDS_PROGRAMS ? end->known : FSM_LINK_DDS_PROGRAMS;
    bool has_numbers = is_counted && numbers->session != 0u;
    uint32_t session = has_numbers ? numbers->session : 0u;
    uint32_t number = has_numbers ? numbers->sequence : 0u;
    dds_guid_t program = program_of(end);
    fsm_link_dds_program *found = NULL;
    for (uint32_t place = 0u; place < known && found == NULL; place++) {
        if (is_same(&end->programs[place].program, &program)) {
            found = &end->programs[place];
        }
    }
    if (found == NULL) {
        if (known > 0u) {
            begin(dds, &program, 0u);
        }
        found = &end->programs[end->known++ % FSM_LINK_DDS_PROGRAMS];
        found->program = program;
    } else if (found->session != session) {
        begin(dds, &program, session);
    } else if (has_numbers) {
        uint32_t gap = number - found->next;
        if (gap > UINT32_MAX / 2u) {
            add(dds, FSM_LINK_DDS_LATE);
            return false;
        }
        fsm_link_fan_missed(dds->fan, dds->node->peer, gap * end->wires);
    }
    found->writer = end->writer;
    found->session = session;
    found->next = number + 1u;
    return true;
}

static void refuse(fsm_link_dds *dds)
{
    static const uint8_t nothing[1] = {0u};
    add(dds, FSM_LINK_DDS_REFUSED);
    (void)fsm_link_arrive(dds->fan->link, dds->node->peer, nothing, 0u); /* counts as malformed */
}

static uint16_t size_of(const fsm_link_dds *dds, uint16_t message)
{
    return message == FSM_LINK_LEVELS ? dds->node->levels
                                      : dds->fan->link->map->message[message - 1u].size;
}

/* Make frames of the message that is held. */
static void arrive(fsm_link_dds *dds, unsigned topic)
{
    fsm_link_dds_end *end = &dds->ends[topic];
    bool is_first = true;
    for (unsigned place = 0u; place < dds->node->wire_count; place++) {
        const fsm_link_dds_wire *wire = &dds->node->wire[place];
        uint8_t payload[FSM_LINK_BYTES];
        fsm_ros_numbers numbers = {0u, 0u, 0u};
        bool fits;
        if (wire->topic != topic) {
            continue;
        }
        memcpy(payload, dds->levels, sizeof payload);
        fits = wire->unpack(end->held, payload, &numbers);
        if (is_first && !is_next(dds, end, dds->node->topic[topic].is_counted, &numbers)) {
            return;
        }
        is_first = false;
        if (!fits) {
            refuse(dds);
        } else if (!fsm_link_fan_arrive(dds->fan, dds->node->peer, wire->message, payload,
                                        size_of(dds, wire->message))) {
            add(dds, FSM_LINK_DDS_REFUSED);
        } else if (wire->message == FSM_LINK_LEVELS) {
            memcpy(dds->levels, payload, sizeof payload);
        }
    }
}

static void release(fsm_link_dds_end *end)
{
    (void)dds_return_loan(end->end, &end->held, 1);
    end->held = NULL;
}

/* Hold the oldest message of a topic; whether there is one. */
static bool hold(fsm_link_dds *dds, fsm_link_dds_end *end)
{
    dds_sample_info_t info;
    while (end->held == NULL && dds_take(end->end, &end->held, &info, 1u, 1u) > 0) {
        if (info.valid_data) {
            add(dds, FSM_LINK_DDS_RECEIVED);
            /* DDS keeps the order within a topic, whatever the clocks of its publishers say */
            end->stamp = info.source_timestamp > end->stamp ? info.source_timestamp : end->stamp;
            end->writer = info.publication_handle;
        } else {
            release(end); /* a publisher has gone */
        }
    }
    return end->held != NULL;
}

/* Hand over what has come, by the times of publishers; false if the link has no room for an event. */
static bool receive(fsm_link_dds *dds)
{
    for (unsigned some = 0u; some < BURST; some++) {
        uint32_t room = fsm_link_room(dds->fan->link);
        unsigned oldest = FSM_LINK_DDS_TOPICS;
        bool is_full = false;
        for (unsigned topic = 0u; topic < dds->node->topic_count; topic++) {
            fsm_link_dds_end *end = &dds->ends[topic];
            if (dds->node->topic[topic].is_sent || !hold(dds, end)) {
                continue;
            }
            if (dds->node->topic[topic].is_event && room < end->wires) {
                is_full = true;
            } else if (oldest == FSM_LINK_DDS_TOPICS || end->stamp < dds->ends[oldest].stamp) {
                oldest = topic;
            }
        }
        if (oldest == FSM_LINK_DDS_TOPICS) {
            return !is_full;
        }
        arrive(dds, oldest);
        release(&dds->ends[oldest]);
    }
    return true;
}

static void *run(void *argument)
{
    fsm_link_dds *dds = argument;
    while (fsm_shared_read(&dds->stop) == 0u) {
        bool has_room = receive(dds);
        bool is_sent = flush_all(dds);
        if (!has_room) {
            dds_sleepfor(RETRY); /* what waits would end any wait for more */
        } else if (dds_waitset_wait(dds->waitset, NULL, 0u, is_sent ? DDS_INFINITY : RETRY) >= 0) {
            bool was_set;
            (void)dds_take_guardcondition(dds->wake, &was_set);
        }
    }
    return NULL;
}

/* ---- a translator ----------------------------------------------------------------------------- */

static dds_qos_t *qos_of(fsm_ros_qos wanted, bool is_event)
{
    dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1; /* as ROS */
    dds_qos_t *qos = dds_create_qos();
    dds_qset_reliability(qos,
                         wanted == FSM_ROS_SENSOR ? DDS_RELIABILITY_BEST_EFFORT
                                                       : DDS_RELIABILITY_RELIABLE,
                         0);
    dds_qset_durability(qos, wanted == FSM_ROS_STATE ? DDS_DURABILITY_TRANSIENT_LOCAL
                                                          : DDS_DURABILITY_VOLATILE);
    dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);
    dds_qset_data_representation(qos, 1u, &plain);
    if (is_event && wanted == FSM_ROS_DEFAULT) {
        dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
        dds_qset_resource_limits(qos, FSM_LINK_SLOTS, 1, FSM_LINK_SLOTS);
    } else {
        int32_t depth = is_event ? FSM_LINK_SLOTS : 1;
        dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
        dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                    DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
    }
    return qos;
}

/* Return a writer, or a reader that ends a wait of the thread; or a code, which is negative. */
static dds_entity_t end_of(fsm_link_dds *dds, const fsm_link_dds_topic *wanted)
{
    dds_qos_t *qos = qos_of(wanted->qos, wanted->is_event);
    dds_entity_t topic =
        dds_create_topic(dds->participant, wanted->type, wanted->name, NULL, NULL);
    dds_entity_t end = topic;
    if (topic > 0 && wanted->is_sent) {
        end = dds_create_writer(dds->participant, topic, qos, NULL);
    } else if (topic > 0) {
        dds_entity_t condition;
        dds_return_t code;
        end = dds_create_reader(dds->participant, topic, qos, NULL);
        condition = end > 0 ? dds_create_readcondition(end, DDS_ANY_STATE) : end;
        code = condition > 0 ? dds_waitset_attach(dds->waitset, condition, 0) : condition;
        end = code < 0 ? code : end;
    }
    dds_delete_qos(qos);
    return end;
}

static int open_ends(fsm_link_dds *dds, int priority)
{
    const fsm_link_dds_node *node = dds->node;
    fsm_dds_domain domain;
    domain.id = node->domain;
    domain.is_insecure = node->is_insecure;
    domain.priority = priority;
    dds->participant = fsm_dds_join(&domain);
    if (dds->participant < 0) {
        return dds->participant;
    }
    dds->wake = dds_create_guardcondition(dds->participant);
    dds->waitset = dds_create_waitset(dds->participant);
    if (dds->wake < 0 || dds->waitset < 0 ||
        dds_waitset_attach(dds->waitset, dds->wake, 0) < 0) {
        return DDS_RETCODE_OUT_OF_RESOURCES;
    }
    for (unsigned place = 0u; place < node->topic_count; place++) {
        dds->ends[place].end = end_of(dds, &node->topic[place]);
        if (dds->ends[place].end < 0) {
            return dds->ends[place].end;
        }
    }
    for (unsigned machine = 0u; machine < node->machine_count; machine++) {
        fsm_link_dds_topic topic;
        memset(&topic, 0, sizeof topic);
        topic.name = node->machine[machine];
        topic.type = node->text;
        topic.qos = FSM_ROS_STATE;
        topic.is_sent = true;
        dds->shown[machine].writer = end_of(dds, &topic);
        if (dds->shown[machine].writer < 0) {
            return dds->shown[machine].writer;
        }
    }
    for (unsigned place = 0u; place < node->wire_count; place++) {
        dds->ends[node->wire[place].topic].wires++;
    }
    return 0;
}

static int start(fsm_link_dds *dds, int priority)
{
    int error = pthread_create(&dds->thread, NULL, run, dds);
    dds->has_thread = error == 0;
    if (dds->has_thread && priority > 0) {
        struct sched_param wish;
        memset(&wish, 0, sizeof wish);
        wish.sched_priority = priority;
        error = pthread_setschedparam(dds->thread, SCHED_FIFO, &wish);
    }
    return error;
}

int fsm_link_dds_open(fsm_link_dds *dds, fsm_link_fan *fan, const fsm_link_dds_node *node,
                      int priority)
{
    int error;
    memset(dds, 0, sizeof *dds);
    dds->node = node;
    dds->fan = fan;
    if (node->topic_count > FSM_LINK_DDS_TOPICS || node->machine_count > FSM_LINK_DDS_MACHINES ||
        node->levels > FSM_LINK_BYTES - FSM_LINK_HEADER) {
        return E2BIG;
    }
    if (node->levels != 0u) {
        memcpy(dds->levels, node->start, node->levels);
    }
    error = pthread_mutex_init(&dds->turn, NULL);
    dds->has_turn = error == 0;
    if (error == 0) {
        error = open_ends(dds, priority);
    }
    if (error == 0) {
        fsm_link_fan_add(fan, node->peer, take, dds);
        error = start(dds, priority);
    }
    if (error != 0) {
        fsm_link_dds_close(dds);
    }
    return error;
}

uint32_t fsm_link_dds_count(const fsm_link_dds *dds, fsm_link_dds_counter what)
{
    return what < FSM_LINK_DDS_COUNTS ? fsm_shared_read(&dds->counts[what]) : 0u;
}

uint32_t fsm_link_dds_waiting(const fsm_link_dds *dds)
{
    return fsm_shared_read(&dds->waits);
}

unsigned fsm_link_dds_unheard(const fsm_link_dds *dds)
{
    unsigned found = 0u;
    for (unsigned topic = 0u; topic < dds->node->topic_count; topic++) {
        dds_publication_matched_status_t status;
        if (dds->node->topic[topic].is_sent &&
            dds_get_publication_matched_status(dds->ends[topic].end, &status) == DDS_RETCODE_OK &&
            status.current_count == 0u) {
            found++;
        }
    }
    return found;
}

unsigned fsm_link_dds_unserved(const fsm_link_dds *dds)
{
    unsigned found = 0u;
    for (unsigned topic = 0u; topic < dds->node->topic_count; topic++) {
        dds_subscription_matched_status_t status;
        if (!dds->node->topic[topic].is_sent &&
            dds_get_subscription_matched_status(dds->ends[topic].end, &status) == DDS_RETCODE_OK &&
            status.current_count == 0u) {
            found++;
        }
    }
    return found;
}

void fsm_link_dds_close(fsm_link_dds *dds)
{
    if (dds->has_thread) {
        fsm_shared_write(&dds->stop, 1u);
        (void)dds_set_guardcondition(dds->wake, true);
        (void)pthread_join(dds->thread, NULL);
        dds->has_thread = false;
    }
    for (unsigned topic = 0u; topic < dds->node->topic_count; topic++) {
        if (dds->ends[topic].held != NULL) {
            release(&dds->ends[topic]);
        }
    }
    fsm_dds_leave(dds->participant);
    dds->participant = 0;
    if (dds->has_turn) {
        (void)pthread_mutex_destroy(&dds->turn);
        dds->has_turn = false;
    }
}
