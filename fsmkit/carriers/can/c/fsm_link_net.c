/* fsm_link_net.c: see fsm_link_net.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_net.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { HELLO_MS = 100, HASH_BYTES = 4, BURST = 256 };

#define ANY_SESSION 0x10000u /* a session that is 0 on the bus, which is not a session */

static uint64_t now_ms(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

static void count(fsm_link_net *net, fsm_link_net_counter what)
{
    fsm_shared_write(&net->counts[what], fsm_shared_own(&net->counts[what]) + 1u);
}

/* ---- to the bus: the sender's ----------------------------------------------------------------- */

static void send_frame(fsm_link_net *net, const fsm_can_message *message, fsm_can_frame *frame)
{
    frame->id = message->id;
    frame->length = message->length;
    count(net, fsm_can_bus_send(&net->bus, frame, message->is_fd) ? FSM_LINK_NET_SENT
                                                                  : FSM_LINK_NET_UNSENT);
}

static void send_hello(fsm_link_net *net)
{
    unsigned row = (unsigned)net->net->events + net->net->nodes + net->link->map->node;
    fsm_can_frame frame;
    memset(&frame, 0, sizeof frame);
    fsm_link_put_bytes(frame.data, net->net->hash, HASH_BYTES);
    fsm_link_put_bytes(frame.data + HASH_BYTES, net->link->session & 0xffffu, 2u);
    fsm_link_put_bytes(frame.data + HASH_BYTES + 2, (net->events - net->left_out) & 0xffffu, 2u);
    send_frame(net, &net->net->message[row], &frame);
}

static void send_one(fsm_link_net *net, const fsm_link_frame *taken)
{
    uint16_t message = fsm_link_message_of(taken);
    bool is_event = message != FSM_LINK_LEVELS;
    unsigned row = is_event ? message - 1u : (unsigned)net->net->events + net->link->map->node;
    fsm_can_frame frame;
    net->events = taken->number + (is_event ? 1u : 0u);
    if (net->net->message[row].length == 0u) {
        net->left_out++; /* for a foreign node */
        return;
    }
    memset(&frame, 0, sizeof frame);
    if (fsm_can_encode(&net->net->message[row], taken->bytes + FSM_LINK_HEADER, frame.data)) {
        frame.data[0] = net->sent[row]++;
        send_frame(net, &net->net->message[row], &frame);
    }
}

static void *run_sender(void *argument)
{
    fsm_link_net *net = argument;
    send_hello(net);
    for (;;) {
        fsm_link_frame frame;
        while (sem_wait(&net->work) != 0) {
            ;
        }
        if (fsm_shared_read(&net->is_over) != 0u) {
            return NULL;
        }
        while (fsm_link_next(net->link, &frame)) {
            send_one(net, &frame);
        }
        if (fsm_shared_read(&net->is_due) != 0u) {
            fsm_shared_write(&net->is_due, 0u);
            send_hello(net);
        }
    }
}

static void wake(void *carrier, fsm_link *link)
{
    fsm_link_net *net = carrier;
    (void)link;
    (void)sem_post(&net->work);
}

/* ---- from the bus: the receiver's ------------------------------------------------------------- */

static uint8_t sender_of(const fsm_link_net *net, unsigned row)
{
    const fsm_link_map *map = net->link->map;
    if (row < map->messages) {
        return map->message[row].sender;
    }
    return (uint8_t)((row - map->messages) % map->nodes);
}

static bool arrive(fsm_link_net *net, uint8_t sender, uint32_t sequence, uint16_t message,
                   const uint8_t *payload, size_t size)
{
    const fsm_link_net_peer *peer = &net->peers[sender];
    fsm_link_head head;
    head.sender = sender;
    head.hash = net->link->map->hash;
    head.session = peer->session;
    head.sequence = sequence;
    head.events = peer->events;
    head.message = message;
    return fsm_link_arrive_as(net->link, &head, payload, size);
}

/* Something came of a node whose map is another. */
static void arrive_foreign(fsm_link_net *net, uint8_t sender)
{
    fsm_link_head head;
    memset(&head, 0, sizeof head);
    head.sender = sender;
    head.hash = ~net->link->map->hash; /* its own may differ in the layout only */
    (void)fsm_link_arrive_as(net->link, &head, NULL, 0u);
}

static void begin_session(fsm_link_net *net, uint8_t sender, uint32_t number, uint32_t events)
{
    fsm_link_net_peer *peer = &net->peers[sender];
    const fsm_link_map *map = net->link->map;
    if (peer->session == 0u) {
        peer->session = number != 0u ? number : ANY_SESSION;
    } else {
        peer->session += (number - peer->session) & 0xffffu; /* on, and never back */
    }
    peer->sequence = 0u;
    peer->events = events;
    peer->ahead = 0u;
    for (unsigned row = 0u; row < (unsigned)map->messages + map->nodes; row++) {
        uint8_t own = sender_of(net, row);
        if (own == sender) {
            net->is_counted[row] = events == 0u && row < map->messages;
            net->next[row] = 0u;
            net->last[row] = 0u;
        }
    }
}

static void hear_hello(fsm_link_net *net, uint8_t sender, const uint8_t *data)
{
    fsm_link_net_peer *peer = &net->peers[sender];
    uint32_t number = (uint32_t)fsm_link_get_bytes(data + HASH_BYTES, 2u);
    uint32_t events = (uint32_t)fsm_link_get_bytes(data + HASH_BYTES + 2, 2u);
    uint32_t newer;
    peer->is_foreign = fsm_link_get_bytes(data, HASH_BYTES) != net->net->hash;
    if (peer->is_foreign) {
        peer->is_known = false;
        arrive_foreign(net, sender);
        fsm_shared_write(&peer->listens, 0u);
        return;
    }
    if (!peer->is_known || (peer->session & 0xffffu) != number) {
        peer->is_known = true;
        begin_session(net, sender, number, events);
    }
    newer = (events - peer->events) & 0xffffu;
    if (newer < 0x8000u) { /* else it was queued before an event that has come */
        peer->events += newer;
        peer->ahead += newer;
    }
    fsm_shared_write(&peer->listens, 1u + number);
}

/* Count what is missing before a frame with this counter; false: it is the last one again. */
static bool count_missing(fsm_link_net *net, unsigned row, uint8_t sender, uint8_t counter)
{
    fsm_link_net_peer *peer = &net->peers[sender];
    uint32_t gap = net->is_counted[row] ? (uint32_t)(uint8_t)(counter - net->next[row]) : 0u;
    if (gap == 0xffu && net->last[row] != 0u) {
        return false;
    }
    peer->sequence += gap;
    if (row < net->link->map->messages) {
        uint32_t known = gap < peer->ahead ? gap : peer->ahead;
        peer->ahead -= known;
        peer->events += gap - known;
    }
    net->next[row] = (uint8_t)(counter + 1u);
    net->is_counted[row] = true;
    return true;
}

static void hear_message(fsm_link_net *net, unsigned row, uint8_t sender,
                         const fsm_can_frame *frame)
{
    static const uint8_t nothing[1] = {0u};
    const fsm_link_map *map = net->link->map;
    fsm_link_net_peer *peer = &net->peers[sender];
    bool is_event = row < map->messages;
    uint16_t message = is_event ? (uint16_t)(row + 1u) : (uint16_t)FSM_LINK_LEVELS;
    size_t size = is_event ? map->message[row].size : map->levels[sender];
    uint8_t payload[FSM_LINK_BYTES];
    bool is_next;
    memset(payload, 0, sizeof payload);
    if (frame->length < net->net->message[row].length) {
        (void)fsm_link_arrive(net->link, sender, nothing, 0u); /* counts as malformed */
        return;
    }
    is_next = count_missing(net, row, sender, frame->data[0]);
    if (fsm_can_decode(&net->net->message[row], frame->data, frame->length, payload) !=
        FSM_CAN_TAKEN) {
        (void)fsm_link_arrive(net->link, sender, nothing, 0u);
    } else {
        uint32_t sequence = is_next ? peer->sequence : net->last[row] - 1u;
        (void)arrive(net, sender, sequence, message, payload, size);
    }
    if (!is_next) { /* it counts as doubled */
        return;
    }
    peer->sequence++;
    peer->events += is_event ? 1u : 0u;
    net->last[row] = peer->sequence;
}

static void hear(fsm_link_net *net, const fsm_can_frame *frame)
{
    const fsm_link_map *map = net->link->map;
    unsigned rows = (unsigned)net->net->events + 2u * net->net->nodes;
    for (unsigned row = 0u; row < rows; row++) {
        const fsm_can_message *message = &net->net->message[row];
        uint8_t sender = sender_of(net, row);
        if (message->length == 0u || message->id != frame->id || sender == map->node) {
            continue;
        }
        count(net, FSM_LINK_NET_RECEIVED);
        if (row >= (unsigned)map->messages + map->nodes) {
            if (frame->length >= message->length) {
                hear_hello(net, sender, frame->data);
            }
        } else if (net->peers[sender].is_foreign) {
            arrive_foreign(net, sender);
        } else if (net->peers[sender].is_known) {
            hear_message(net, row, sender, frame);
        }
        return;
    }
}

/* Let the sender say hello every HELLO_MS, from the start on, but not for a loop that hangs. */
static void call_for_hello(fsm_link_net *net, uint64_t now, uint64_t *due)
{
    bool is_live = fsm_link_is_live(net->link, &net->watch, now);
    if (now < *due) {
        return;
    }
    *due = now + HELLO_MS;
    if (is_live || fsm_link_completed(net->link) == 0u) {
        fsm_shared_write(&net->is_due, 1u);
        (void)sem_post(&net->work);
    }
}

static void *run_receiver(void *argument)
{
    fsm_link_net *net = argument;
    uint64_t due = now_ms() + HELLO_MS;
    struct pollfd ready[2];
    memset(ready, 0, sizeof ready);
    ready[0].fd = net->stop[0];
    ready[1].fd = net->bus.in;
    ready[0].events = ready[1].events = POLLIN;
    fsm_link_watch(net->link, &net->watch, now_ms());
    for (;;) {
        uint64_t now = now_ms(), wait = fsm_watch_every(&net->watch);
        fsm_can_frame frame;
        call_for_hello(net, now, &due);
        if (poll(ready, 2u, (int)(due - now < wait ? due - now : wait)) < 0 && errno != EINTR) {
            return NULL;
        }
        if (ready[0].revents != 0) {
            return NULL;
        }
        memset(&frame, 0, sizeof frame);
        for (unsigned some = 0u; some < BURST && fsm_can_bus_receive(&net->bus, &frame); some++) {
            if ((frame.id & FSM_CAN_ERROR) != 0u) {
                fsm_link_bus_error(net->link, (frame.id & FSM_CAN_BUS_OFF) != 0u);
            } else {
                hear(net, &frame);
            }
        }
        if (net->link->faults != NULL) {
            fsm_link_pass_time(net->link);
        }
    }
}

/* ---- a transport ------------------------------------------------------------------------------ */

static bool heard_by(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms)
{
    const fsm_link_net *net = carrier;
    const struct timespec pause = {0, 1000000};
    uint64_t end = now_ms() + timeout_ms;
    (void)link;
    for (;;) {
        FSM_INDEX found = fsm_shared_read(&net->peers[peer].listens);
        if (found != 0u && (session == 0u || found == 1u + (session & 0xffffu))) {
            return true;
        }
        if (now_ms() >= end) {
            return false;
        }
        (void)nanosleep(&pause, NULL);
    }
}

static const fsm_link_transport transport = {wake, NULL, heard_by, false};

int fsm_link_net_open(fsm_link_net *net, fsm_link *link, const fsm_can_net *tables, const char *bus)
{
    unsigned rows = (unsigned)tables->events + 2u * tables->nodes;
    int error;
    memset(net, 0, sizeof *net);
    net->net = tables;
    net->link = link;
    net->bus.in = net->bus.out = net->stop[0] = net->stop[1] = -1;
    if (rows > FSM_LINK_NET_MESSAGES || tables->events != link->map->messages ||
        tables->nodes != link->map->nodes || tables->nodes > FSM_LINK_NODES) {
        return E2BIG;
    }
    error = fsm_can_bus_open(&net->bus, bus, tables->message, rows);
    if (error != 0) {
        return error;
    }
    net->has_work = sem_init(&net->work, 0, 0u) == 0;
    if (!net->has_work || pipe(net->stop) != 0) {
        error = errno;
    }
    if (error == 0) {
        fsm_link_attach(link, &transport, net);
        error = pthread_create(&net->sender, NULL, run_sender, net);
        net->has_sender = error == 0;
    }
    if (error == 0) {
        error = pthread_create(&net->receiver, NULL, run_receiver, net);
        net->has_receiver = error == 0;
    }
    if (error != 0) {
        fsm_link_net_close(net);
    }
    return error;
}

uint32_t fsm_link_net_count(const fsm_link_net *net, fsm_link_net_counter what)
{
    return what < FSM_LINK_NET_COUNTS ? (uint32_t)fsm_shared_read(&net->counts[what]) : 0u;
}

void fsm_link_net_close(fsm_link_net *net)
{
    fsm_link_attach(net->link, NULL, NULL);
    if (net->has_receiver) {
        (void)!write(net->stop[1], "", 1u);
        (void)pthread_join(net->receiver, NULL);
    }
    if (net->has_sender) {
        fsm_shared_write(&net->is_over, 1u);
        (void)sem_post(&net->work);
        (void)pthread_join(net->sender, NULL);
    }
    for (unsigned end = 0u; end < 2u; end++) {
        if (net->stop[end] >= 0) {
            (void)close(net->stop[end]);
        }
        net->stop[end] = -1;
    }
    if (net->has_work) {
        (void)sem_destroy(&net->work);
    }
    net->has_work = net->has_sender = net->has_receiver = false;
    fsm_can_bus_close(&net->bus);
}
