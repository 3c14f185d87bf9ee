/* fsm_link_gate.c: see fsm_link_gate.h; the same as ../gate.py. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_gate.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zmq.h>
#if defined(__linux__)
#include <linux/tcp.h>
#endif

enum {
    APART_MS = 10, /* from look to look */
    LOOKS = 4096, /* events that are looked at in one go */
    EVENT = 6     /* bytes: what it is (2), and its value (4), in the order of this processor */
};

typedef char fsm_link_places_have_room
    [sizeof(struct sockaddr_storage) == sizeof(((fsm_link_place *)0)->bytes) ? 1 : -1];

/* ---- handles ---------------------------------------------------------------------------------- */

/* Whether two sockets have the same place: one listens there, the other was accepted there. */
static bool is_same(const fsm_link_place *one, const fsm_link_place *other)
{
    struct sockaddr_in6 a, b; /* family and port are in the same place as in sockaddr_in */
    memcpy(&a, one->bytes, sizeof a);
    memcpy(&b, other->bytes, sizeof b);
    if (a.sin6_family != b.sin6_family) {
        return false;
    }
    if (a.sin6_family == AF_INET || a.sin6_family == AF_INET6) {
        return a.sin6_port == b.sin6_port;
    }
    return one->length == other->length && memcmp(one->bytes, other->bytes, one->length) == 0;
}

/* A handle of our own of a socket, and its place; -1 where the number is no socket's any more. */
static int handle_of(int number, fsm_link_place *place)
{
    struct sockaddr_storage name;
    socklen_t length = sizeof name;
    int own = fcntl(number, F_DUPFD_CLOEXEC, 3);
    memset(&name, 0, sizeof name);
    if (own >= 0 && getsockname(own, (struct sockaddr *)&name, &length) != 0) {
        (void)close(own);
        own = -1;
    }
    place->length = length < sizeof place->bytes ? (uint32_t)length : sizeof place->bytes;
    memcpy(place->bytes, &name, sizeof place->bytes);
    return own;
}

/* The bytes that came by a connection; 0 where the system does not count them. */
static uint64_t received(int handle)
{
#if defined(__linux__)
    struct tcp_info info;
    socklen_t length = sizeof info;
    memset(&info, 0, sizeof info);
    if (getsockopt(handle, IPPROTO_TCP, TCP_INFO, &info, &length) == 0 &&
        length >= offsetof(struct tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received)
        return info.tcpi_bytes_received;
#else
    (void)handle;
#endif
    return 0u;
}

/* ---- seats ------------------------------------------------------------------------------------ */

static void vacate(fsm_link_gate *gate, int place)
{
    (void)close(gate->seats[place].handle);
    gate->taken--;
    memmove(&gate->seats[place], &gate->seats[place + 1],
            (size_t)(gate->taken - place) * sizeof gate->seats[0]);
}

static void put_out(fsm_link_gate *gate, int place)
{
    (void)shutdown(gate->seats[place].handle, SHUT_RDWR);
    vacate(gate, place);
    fsm_shared_write(&gate->dropped, (FSM_INDEX)(fsm_shared_own(&gate->dropped) + 1u));
}

static void leave(fsm_link_gate *gate, int number)
{
    for (int i = gate->taken - 1; i >= 0; i--) {
        if (gate->seats[i].number == number) {
            vacate(gate, i);
        }
    }
}

static void enter(fsm_link_gate *gate, int number, uint64_t now_ms)
{
    fsm_link_place place;
    fsm_link_seat *seat = &gate->seats[gate->taken];
    int handle = handle_of(number, &place);
    if (handle < 0) {
        return;
    }
    if (!is_same(&place, &gate->place)) {
        (void)close(handle); /* it has gone, and its number is another's */
        return;
    }
    seat->number = number;
    seat->handle = handle;
    seat->node = -1;
    seat->since_ms = now_ms;
    gate->taken++;
    for (int i = 0; gate->taken > FSM_LINK_SEATS && i < gate->taken; i++) {
        if (gate->seats[i].node < 0) {
            put_out(gate, i);
        }
    }
}

static void listen_at(fsm_link_gate *gate, int number)
{
    int handle = handle_of(number, &gate->place);
    if (handle >= 0) {
        (void)close(handle);
    }
}

void fsm_link_gate_know(fsm_link_gate *gate, int number, int node)
{
    for (int i = 0; i < gate->taken; i++) {
        if (gate->seats[i].number == number) {
            gate->seats[i].node = node;
        } else if (gate->seats[i].node == node) {
            gate->seats[i].node = -1;
        }
    }
}

/* ---- what the monitor reports ----------------------------------------------------------------- */

/* Take the rest of a message that is longer than was looked at. */
static void skip_rest(void *socket)
{
    int more = 0;
    size_t size = sizeof more;
    while (zmq_getsockopt(socket, ZMQ_RCVMORE, &more, &size) == 0 && more != 0) {
        if (zmq_recv(socket, NULL, 0, ZMQ_DONTWAIT) < 0) {
            return;
        }
    }
}

static bool look_once(fsm_link_gate *gate, uint64_t now_ms)
{
    uint8_t event[EVENT];
    uint16_t what;
    int32_t number;
    int length = zmq_recv(gate->monitor, event, sizeof event, ZMQ_DONTWAIT);
    if (length < 0) {
        return false;
    }
    skip_rest(gate->monitor);
    if (length != EVENT) {
        return true;
    }
    memcpy(&what, event, sizeof what);
    memcpy(&number, event + sizeof what, sizeof number);
    leave(gate, number);
    if (what == ZMQ_EVENT_ACCEPTED) {
        enter(gate, number, now_ms);
    } else if (what == ZMQ_EVENT_LISTENING) {
        listen_at(gate, number);
    }
    return true;
}

void fsm_link_gate_look(fsm_link_gate *gate, uint64_t now_ms)
{
    if (gate->door == NULL || now_ms - gate->looked_ms < APART_MS) {
        return;
    }
    gate->looked_ms = now_ms;
    for (int i = 0; i < LOOKS && look_once(gate, now_ms); i++) {
        ;
    }
    for (int i = gate->taken - 1; i >= 0; i--) {
        const fsm_link_seat *seat = &gate->seats[i];
        uint64_t age = now_ms - seat->since_ms;
        uint64_t most = FSM_LINK_SAID_BYTES + FSM_LINK_SAID_BYTES * age / 1000u;
        if ((seat->node < 0 && age > FSM_LINK_STRANGER_MS) || received(seat->handle) > most) {
            put_out(gate, i);
        }
    }
}

/* ---- opening and closing ---------------------------------------------------------------------- */

bool fsm_link_gate_open(fsm_link_gate *gate, void *context, void *door)
{
    char where[48];
    int none = 0;
    memset(gate, 0, sizeof *gate);
    (void)snprintf(where, sizeof where, "inproc://fsm-link-gate-%p", (void *)gate);
    gate->monitor = zmq_socket(context, ZMQ_PAIR);
    if (gate->monitor == NULL) {
        return false;
    }
    gate->door = door;
    return zmq_setsockopt(gate->monitor, ZMQ_LINGER, &none, sizeof none) == 0 &&
           /* without bound: whoever reports, a thread of ZeroMQ, must never wait for us */
           zmq_setsockopt(gate->monitor, ZMQ_RCVHWM, &none, sizeof none) == 0 &&
           zmq_socket_monitor(door, where,
                              ZMQ_EVENT_LISTENING | ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED) == 0 &&
           zmq_connect(gate->monitor, where) == 0;
}

void fsm_link_gate_close(fsm_link_gate *gate)
{
    if (gate->door != NULL) {
        (void)zmq_socket_monitor(gate->door, NULL, 0);
    }
    if (gate->monitor != NULL) {
        (void)zmq_close(gate->monitor);
    }
    gate->door = gate->monitor = NULL;
    while (gate->taken > 0) {
        vacate(gate, gate->taken - 1);
    }
}
