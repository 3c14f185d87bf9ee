/* fsm_link_can.c: see fsm_link_can.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_can.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LONGEST_MS = 1000, BURST = 256 };

static uint64_t now_ms(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

static void count(fsm_link_can *can, fsm_link_can_counter what)
{
    (void)pthread_mutex_lock(&can->turn);
    can->counts[what]++;
    (void)pthread_mutex_unlock(&can->turn);
}

/* ---- to the bus ------------------------------------------------------------------------------- */

static void send_message(fsm_link_can *can, const fsm_can_message *message, const uint8_t *payload)
{
    fsm_can_frame frame;
    memset(&frame, 0, sizeof frame);
    frame.id = message->id;
    frame.length = message->length;
    if (!fsm_can_encode(message, payload, frame.data)) {
        count(can, FSM_LINK_CAN_REFUSED);
    } else if (fsm_can_bus_send(&can->bus, &frame, message->is_fd)) {
        count(can, FSM_LINK_CAN_SENT);
    } else {
        count(can, FSM_LINK_CAN_UNSENT);
    }
}

/* In the thread that takes frames out of the link. */
static void take(void *translator, const fsm_link_frame *frame)
{
    fsm_link_can *can = translator;
    const fsm_can_node *node = can->node;
    const uint8_t *payload = frame->bytes + FSM_LINK_HEADER;
    uint16_t message = fsm_link_message_of(frame);
    if (message == FSM_LINK_LEVELS) {
        (void)pthread_mutex_lock(&can->turn);
        memcpy(can->own, payload, (size_t)frame->length - FSM_LINK_HEADER);
        can->has_levels = true;
        (void)pthread_mutex_unlock(&can->turn);
        return;
    }
    for (unsigned place = 0u; place < node->sent_count; place++) {
        if (node->sent[place].message == message) {
            send_message(can, &node->sent[place], payload);
        }
    }
}

/* Send the cyclic messages whose time has come, unless the loop hangs. */
static void send_levels(fsm_link_can *can, uint64_t now)
{
    const fsm_can_node *node = can->node;
    bool is_live = fsm_link_is_live(can->fan->link, &can->watch, now);
    uint8_t own[FSM_LINK_BYTES];
    bool has_levels;
    (void)pthread_mutex_lock(&can->turn);
    memcpy(own, can->own, sizeof own);
    has_levels = can->has_levels;
    (void)pthread_mutex_unlock(&can->turn);
    for (unsigned place = 0u; place < node->sent_count && has_levels && is_live; place++) {
        uint64_t *due = &can->due_ms[place];
        if (node->sent[place].message != FSM_LINK_LEVELS || *due > now) {
            continue;
        }
        send_message(can, &node->sent[place], own);
        *due += node->sent[place].cycle_ms;
        if (*due <= now) { /* the thread was late: there is no burst */
            *due = now + node->sent[place].cycle_ms;
        }
    }
}

/* ---- from the bus ----------------------------------------------------------------------------- */

static bool is_cyclic(const fsm_link_can *can, unsigned place)
{
    return can->node->received[place].cycle_ms != 0u;
}

static void hear(fsm_link_can *can, unsigned place, uint64_t now)
{
    bool is_back = is_cyclic(can, place);
    for (unsigned other = 0u; other < can->node->received_count; other++) {
        is_back = is_back && (!is_cyclic(can, other) || can->is_silent[other]);
    }
    if (is_back) {
        fsm_link_fan_restarted(can->fan, can->node->peer);
    }
    can->heard_ms[place] = now;
    can->is_silent[place] = false;
}

static void refuse(fsm_link_can *can)
{
    static const uint8_t nothing[1] = {0u};
    count(can, FSM_LINK_CAN_REFUSED);
    (void)fsm_link_arrive(can->fan->link, can->node->peer, nothing, 0u); /* counts as malformed */
}

static uint16_t size_of(const fsm_link_can *can, uint16_t message)
{
    return can->fan->link->map->message[message - 1u].size;
}

static void arrive(fsm_link_can *can, const fsm_can_frame *frame, uint64_t now)
{
    const fsm_can_node *node = can->node;
    bool is_known = false, is_taken = false;
    for (unsigned place = 0u; place < node->received_count; place++) {
        const fsm_can_message *message = &node->received[place];
        bool is_levels = message->message == FSM_LINK_LEVELS;
        uint8_t payload[FSM_LINK_BYTES];
        fsm_can_result result;
        if (message->id != frame->id) {
            continue;
        }
        is_known = true;
        result = fsm_can_decode(message, frame->data, frame->length,
                                is_levels ? can->levels : payload);
        if (result == FSM_CAN_OTHER) {
            continue;
        }
        if (result == FSM_CAN_REFUSED) {
            break;
        }
        is_taken = true;
        hear(can, place, now);
        if (is_levels) {
            (void)fsm_link_fan_arrive(can->fan, node->peer, FSM_LINK_LEVELS, can->levels,
                                      node->levels);
        } else if (message->message != FSM_CAN_NOWHERE) {
            (void)fsm_link_fan_arrive(can->fan, node->peer, message->message, payload,
                                      size_of(can, message->message));
        }
    }
    if (is_known) {
        count(can, FSM_LINK_CAN_RECEIVED);
    }
    if (is_known && !is_taken) {
        refuse(can);
    }
}

static void receive(fsm_link_can *can, uint64_t now)
{
    fsm_can_frame frame;
    for (unsigned some = 0u; some < BURST && fsm_can_bus_receive(&can->bus, &frame); some++) {
        if ((frame.id & FSM_CAN_ERROR) != 0u) {
            fsm_link_bus_error(can->fan->link, (frame.id & FSM_CAN_BUS_OFF) != 0u);
            count(can, FSM_LINK_CAN_BUS_ERRORS);
            if ((frame.id & FSM_CAN_BUS_OFF) != 0u) {
                count(can, FSM_LINK_CAN_BUS_OFF);
            }
        } else if ((frame.id & FSM_CAN_REMOTE) == 0u) {
            arrive(can, &frame, now);
        }
    }
}

/* Post the events of messages that have not come for 2.5 cycles. */
static void post_silences(fsm_link_can *can, uint64_t now)
{
    const fsm_can_node *node = can->node;
    for (unsigned place = 0u; place < node->received_count; place++) {
        uint64_t limit = 5u * (uint64_t)node->received[place].cycle_ms;
        if (limit == 0u || can->is_silent[place] || 2u * (now - can->heard_ms[place]) < limit) {
            continue;
        }
        can->is_silent[place] = true;
        for (unsigned other = 0u; other < node->silence_count; other++) {
            const fsm_can_silence *silence = &node->silence[other];
            if (silence->received == place) {
                (void)fsm_link_fan_arrive(can->fan, node->peer, silence->message, can->levels, 0u);
            }
        }
    }
}

static int until_due(const fsm_link_can *can, uint64_t now)
{
    const fsm_can_node *node = can->node;
    uint64_t look = can->watch.looked + fsm_watch_every(&can->watch);
    uint64_t next = now + LONGEST_MS;
    for (unsigned place = 0u; place < node->received_count; place++) {
        uint64_t limit = (5u * (uint64_t)node->received[place].cycle_ms + 1u) / 2u;
        if (limit != 0u && !can->is_silent[place] && can->heard_ms[place] + limit < next) {
            next = can->heard_ms[place] + limit;
        }
    }
    for (unsigned place = 0u; place < node->sent_count; place++) {
        /* a message that is overdue waits for the loop to start, or to go on */
        uint64_t due = can->due_ms[place] > now ? can->due_ms[place] : now + 1u;
        due = look < due ? look : due;
        if (node->sent[place].message == FSM_LINK_LEVELS && due < next) {
            next = due;
        }
    }
    return next > now ? (int)(next - now) : 0;
}

static void *run(void *argument)
{
    fsm_link_can *can = argument;
    struct pollfd ready[2];
    memset(ready, 0, sizeof ready);
    ready[0].fd = can->stop[0];
    ready[1].fd = can->bus.in;
    ready[0].events = ready[1].events = POLLIN;
    for (;;) {
        int found = poll(ready, 2u, until_due(can, now_ms()));
        uint64_t now = now_ms();
        if (found < 0 && errno != EINTR) {
            return NULL;
        }
        if (found > 0 && ready[0].revents != 0) {
            return NULL;
        }
        if (found > 0 && ready[1].revents != 0) {
            receive(can, now);
        }
        post_silences(can, now);
        send_levels(can, now);
    }
}

/* ---- a translator ----------------------------------------------------------------------------- */

int fsm_link_can_open(fsm_link_can *can, fsm_link_fan *fan, const fsm_can_node *node,
                      const char *bus)
{
    int error;
    memset(can, 0, sizeof *can);
    can->bus.in = can->bus.out = can->stop[0] = can->stop[1] = -1;
    can->node = node;
    can->fan = fan;
    if (node->received_count > FSM_LINK_CAN_MESSAGES || node->sent_count > FSM_LINK_CAN_MESSAGES ||
        node->levels > FSM_LINK_BYTES - FSM_LINK_HEADER)
        return E2BIG;
    if (node->levels != 0u) {
        memcpy(can->levels, node->start, node->levels);
    }
    for (unsigned place = 0u; place < FSM_LINK_CAN_MESSAGES; place++) {
        can->heard_ms[place] = can->due_ms[place] = now_ms();
    }
    fsm_link_watch(fan->link, &can->watch, now_ms());
    error = fsm_can_bus_open(&can->bus, bus, node->received, node->received_count);
    if (error != 0) {
        return error;
    }
    error = pthread_mutex_init(&can->turn, NULL);
    if (error == 0 && pipe(can->stop) != 0) {
        error = errno;
    }
    if (error == 0) {
        fsm_link_fan_add(fan, node->peer, take, can);
        error = pthread_create(&can->thread, NULL, run, can);
        can->has_thread = error == 0;
    }
    if (error != 0) {
        fsm_link_can_close(can);
    }
    return error;
}

uint32_t fsm_link_can_count(fsm_link_can *can, fsm_link_can_counter what)
{
    uint32_t found;
    (void)pthread_mutex_lock(&can->turn);
    found = what < FSM_LINK_CAN_COUNTS ? can->counts[what] : 0u;
    (void)pthread_mutex_unlock(&can->turn);
    return found;
}

void fsm_link_can_close(fsm_link_can *can)
{
    if (can->has_thread) {
        (void)!write(can->stop[1], "", 1u);
        (void)pthread_join(can->thread, NULL);
        can->has_thread = false;
    }
    for (unsigned end = 0u; end < 2u; end++) {
        if (can->stop[end] >= 0) {
            (void)close(can->stop[end]);
        }
        can->stop[end] = -1;
    }
    fsm_can_bus_close(&can->bus);
}
