/* fsm_link_rclc.c: see fsm_link_rclc.h. */
#include "fsm_link_rclc.h"

#include <string.h>

enum { SESSION = 8, EVENTS = 16 }; /* offsets in a frame: docs/reference/links.md */

/* ---- to the topics ---------------------------------------------------------------------------- */

static bool publish(fsm_link_rclc *rclc, const fsm_link_rclc_wire *wire, const uint8_t *payload,
                    const fsm_ros_numbers *numbers)
{
    bool is_sent = wire->publish(&rclc->ends[wire->topic].publisher, payload, numbers) == RCL_RET_OK;
    rclc->counts[is_sent ? FSM_LINK_RCLC_SENT : FSM_LINK_RCLC_UNSENT]++;
    return is_sent;
}

static void send_event(fsm_link_rclc *rclc, const fsm_link_rclc_wire *wire,
                       const fsm_link_frame *frame)
{
    fsm_ros_numbers numbers;
    numbers.session = (uint32_t)fsm_link_get_bytes(frame->bytes + SESSION, 4u);
    numbers.sequence = rclc->ends[wire->topic].sequence++; /* also of one that is not sent */
    numbers.events = (uint32_t)fsm_link_get_bytes(frame->bytes + EVENTS, 4u);
    (void)publish(rclc, wire, frame->bytes + FSM_LINK_HEADER, &numbers);
}

/* Publish a level if it has changed. What rcl does not take is tried again with the next levels. */
static void send_level(fsm_link_rclc *rclc, const fsm_link_rclc_wire *wire, const uint8_t *payload)
{
    static const fsm_ros_numbers none = {0u, 0u, 0u};
    bool *is_published = &rclc->ends[wire->topic].is_published;
    bool is_same = memcmp(rclc->own + wire->at, payload + wire->at, wire->size) == 0;
    if (!*is_published || !is_same || rclc->node->topic[wire->topic].qos == FSM_ROS_SENSOR) {
        *is_published = publish(rclc, wire, payload, &none);
        memcpy(rclc->own + wire->at, payload + wire->at, wire->size);
    }
}

static void take(fsm_link_rclc *rclc, const fsm_link_frame *frame)
{
    uint16_t message = fsm_link_message_of(frame);
    for (uint16_t place = 0u; place < rclc->node->wire_count; place++) {
        const fsm_link_rclc_wire *wire = &rclc->node->wire[place];
        if (wire->publish == NULL || wire->message != message) {
            continue;
        }
        if (message == FSM_LINK_LEVELS) {
            send_level(rclc, wire, frame->bytes + FSM_LINK_HEADER);
        } else {
            send_event(rclc, wire, frame);
        }
    }
}

/* The cycle ends: publish what leaves. */
static void wake(void *carrier, fsm_link *link)
{
    fsm_link_frame frame;
    while (fsm_link_next(link, &frame)) {
        for (fsm_link_rclc *each = carrier; each != NULL; each = each->others) {
            take(each, &frame);
        }
    }
}

/* ---- from the topics -------------------------------------------------------------------------- */

static void begin(fsm_link_rclc *rclc)
{
    rclc->session++;
    rclc->sequence = rclc->events = 0u;
}

static uint16_t wires_of(const fsm_link_rclc *rclc, uint16_t topic)
{
    uint16_t found = 0u;
    for (uint16_t place = 0u; place < rclc->node->wire_count; place++) {
        found = (uint16_t)(found + (rclc->node->wire[place].topic == topic ? 1u : 0u));
    }
    return found;
}

/* Whether a message is in order; count gaps, start a session for another one. */
static bool is_next(fsm_link_rclc *rclc, uint16_t topic, const fsm_ros_numbers *numbers)
{
    fsm_link_rclc_end *end = &rclc->ends[topic];
    bool has_numbers = rclc->node->topic[topic].is_counted && numbers->session != 0u;
    uint32_t session = has_numbers ? numbers->session : 0u;
    uint32_t number = has_numbers ? numbers->sequence : 0u;
    if (end->is_known && end->session != session) {
        begin(rclc);
    } else if (end->is_known && has_numbers) {
        uint32_t gap = number - end->next;
        if (gap > UINT32_MAX / 2u) {
            rclc->counts[FSM_LINK_RCLC_LATE]++;
            return false;
        }
        rclc->sequence += gap * wires_of(rclc, topic);
        rclc->events += gap * wires_of(rclc, topic);
    }
    end->is_known = true;
    end->session = session;
    end->next = number + 1u;
    return true;
}

static void arrive_as(fsm_link_rclc *rclc, uint16_t message, const uint8_t *payload)
{
    const fsm_link_map *map = rclc->link->map;
    bool is_event = message != FSM_LINK_LEVELS;
    fsm_link_head head;
    head.sender = rclc->node->peer;
    head.hash = map->hash;
    head.session = rclc->session;
    head.sequence = rclc->sequence;
    head.events = rclc->events;
    head.message = message;
    if (!fsm_link_arrive_as(rclc->link, &head, payload,
                            is_event ? map->message[message - 1u].size : rclc->node->levels)) {
        rclc->counts[FSM_LINK_RCLC_REFUSED]++;
        return;
    }
    rclc->sequence++;
    rclc->events += is_event ? 1u : 0u;
    if (!is_event) {
        memcpy(rclc->levels, payload, rclc->node->levels);
    }
}

static void arrive(const void *sample, void *context)
{
    static const uint8_t nothing[1] = {0u};
    fsm_link_rclc_end *end = context;
    fsm_link_rclc *rclc = end->of;
    uint16_t topic = (uint16_t)(end - rclc->ends);
    bool is_first = true;
    rclc->counts[FSM_LINK_RCLC_RECEIVED]++;
    for (uint16_t place = 0u; place < rclc->node->wire_count; place++) {
        const fsm_link_rclc_wire *wire = &rclc->node->wire[place];
        uint8_t payload[FSM_LINK_BYTES];
        fsm_ros_numbers numbers = {0u, 0u, 0u};
        bool fits;
        if (wire->topic != topic) {
            continue;
        }
        memcpy(payload, rclc->levels, sizeof payload);
        fits = wire->unpack(sample, payload, &numbers);
        if (is_first && !is_next(rclc, topic, &numbers)) {
            return;
        }
        is_first = false;
        if (fits) {
            arrive_as(rclc, wire->message, payload);
        } else {
            rclc->counts[FSM_LINK_RCLC_REFUSED]++;
            (void)fsm_link_arrive(rclc->link, rclc->node->peer, nothing, 0u); /* malformed */
        }
    }
}

/* ---- a translator ----------------------------------------------------------------------------- */

static rmw_qos_profile_t qos_of(const fsm_link_rclc_topic *topic)
{
    rmw_qos_profile_t qos = rmw_qos_profile_default;
    qos.depth = topic->is_event ? FSM_LINK_SLOTS : 1u;
    qos.reliability = topic->qos == FSM_ROS_SENSOR ? RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT
                                                   : RMW_QOS_POLICY_RELIABILITY_RELIABLE;
    qos.durability = topic->qos == FSM_ROS_STATE ? RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL
                                                 : RMW_QOS_POLICY_DURABILITY_VOLATILE;
    return qos;
}

static rcl_ret_t open_end(fsm_link_rclc *rclc, uint16_t place, rclc_executor_t *executor)
{
    const fsm_link_rclc_topic *topic = &rclc->node->topic[place];
    fsm_link_rclc_end *end = &rclc->ends[place];
    rmw_qos_profile_t qos = qos_of(topic);
    rcl_ret_t code;
    end->of = rclc;
    if (topic->is_sent) {
        end->publisher = rcl_get_zero_initialized_publisher();
        code = rclc_publisher_init(&end->publisher, rclc->ros, topic->type(), topic->name, &qos);
        end->is_open = code == RCL_RET_OK;
        return code;
    }
    end->subscription = rcl_get_zero_initialized_subscription();
    code = rclc_subscription_init(&end->subscription, rclc->ros, topic->type(), topic->name, &qos);
    end->is_open = code == RCL_RET_OK;
    if (code == RCL_RET_OK) {
        code = rclc_executor_add_subscription_with_context(executor, &end->subscription,
                                                           topic->message, arrive, end, ON_NEW_DATA);
    }
    return code;
}

rcl_ret_t fsm_link_rclc_open(fsm_link_rclc *rclc, fsm_link *link, const fsm_link_rclc_node *node,
                             rcl_node_t *ros, rclc_executor_t *executor)
{
    static const fsm_link_transport transport = {wake, NULL, NULL, false};
    rcl_ret_t code = RCL_RET_OK;
    memset(rclc, 0, sizeof *rclc);
    rclc->node = node;
    rclc->link = link;
    rclc->ros = ros;
    rclc->session = 1u;
    if (node->topic_count > FSM_LINK_RCLC_TOPICS ||
        node->levels > FSM_LINK_BYTES - FSM_LINK_HEADER) {
        return RCL_RET_ERROR;
    }
    if (node->levels != 0u) {
        memcpy(rclc->levels, node->start, node->levels);
    }
    for (uint16_t place = 0u; place < node->topic_count && code == RCL_RET_OK; place++) {
        code = open_end(rclc, place, executor);
    }
    if (code != RCL_RET_OK) {
        fsm_link_rclc_close(rclc);
        return code;
    }
    rclc->others = link->carrier;
    fsm_link_attach(link, &transport, rclc);
    return RCL_RET_OK;
}

uint32_t fsm_link_rclc_count(const fsm_link_rclc *rclc, fsm_link_rclc_counter what)
{
    return what < FSM_LINK_RCLC_COUNTS ? rclc->counts[what] : 0u;
}

void fsm_link_rclc_close(fsm_link_rclc *rclc)
{
    fsm_link_attach(rclc->link, NULL, NULL);
    for (uint16_t place = 0u; place < rclc->node->topic_count && place < FSM_LINK_RCLC_TOPICS;
         place++) {
        fsm_link_rclc_end *end = &rclc->ends[place];
        if (end->is_open && rclc->node->topic[place].is_sent) {
            (void)rcl_publisher_fini(&end->publisher, rclc->ros);
        } else if (end->is_open) {
            (void)rcl_subscription_fini(&end->subscription, rclc->ros);
        }
        end->is_open = false;
    }
}
