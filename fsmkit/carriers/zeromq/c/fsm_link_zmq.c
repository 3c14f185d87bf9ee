/* fsm_link_zmq.c: see fsm_link_zmq.h. */
#ifdef __linux__
#define _GNU_SOURCE /* pthread_setaffinity_np */
#endif
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_zmq.h"

#include <errno.h>
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <zmq.h>

enum {
    PATROL_MS = 10,    /* the polling interval for changes that wake no thread */
    HELLO_MS = 50,     /* from hello to hello, unless there is news */
    RECONNECT_MS = 10, /* after a peer has gone; longer and longer, up to the next */
    RECONNECT_MOST_MS = 200,
    GONE_MS = 2000, /* without an acknowledgement a connection is closed and opened again */
    LINGER_MS = 500,
    SMALL = 1024, /* bytes of a message at least: handshakes of ZMTP take up to so many */
    /* Messages of one connection that wait to be seen; the gate ends it long before. A limit that
     * can be reached is no protection: when ZeroMQ has stopped reading a connection and that ends, a
     * PING that waits behind, or an expired heartbeat, ends the process ("Assertion failed:
     * !_io_error"). So there are no heartbeats of ZeroMQ either. */
    WAITING = 1 << 20,
    PARTS = 4096, /* parts of messages that are taken from the publisher at one look */
    TOGETHER = 65536 /* frames that may wait to be taken, or to be sent in a deterministic link */
};

static uint64_t milliseconds(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

/* ---- who listens ------------------------------------------------------------------------------ */

/* Take one received part of the publisher: a route, or a hello; false if there is no part. */
static bool hear_part(fsm_link_zmq *zmq, uint64_t now)
{
    zmq_msg_t part;
    size_t length;
    const uint8_t *bytes;
    bool has_more;
    (void)zmq_msg_init(&part);
    if (zmq_msg_recv(&part, zmq->publisher, ZMQ_DONTWAIT) < 0) {
        (void)zmq_msg_close(&part);
        return false;
    }
    bytes = zmq_msg_data(&part);
    length = zmq_msg_size(&part);
    has_more = zmq_msg_more(&part) != 0;
    if (zmq->received.parts == 0u) {
        zmq->received.length = length;
        memcpy(zmq->received.route, bytes, length < FSM_LINK_ROUTE ? length : FSM_LINK_ROUTE);
    } else if (zmq->received.parts == 1u && !has_more) {
        int key_of = zmq->has_keys ? fsm_link_keys_of(&part) : FSM_LINK_NO_KEYS;
        int peer = fsm_link_hello_receive(&zmq->hellos, bytes, length, zmq->received.route,
                                       zmq->received.length, key_of, now);
        if (peer >= 0) {
            fsm_link_gate_know(&zmq->gate, zmq_msg_get(&part, ZMQ_SRCFD), peer);
        }
    }
    zmq->received.parts = has_more ? (zmq->received.parts < 2u ? zmq->received.parts + 1u : 2u) : 0u;
    (void)zmq_msg_close(&part);
    return true;
}

/* Process the connections and disconnections of peers, up to a limit, so that a flood does not block this
 * thread. It then continues immediately after its other work. */
static void see_listeners(fsm_link_zmq *zmq)
{
    uint64_t now = milliseconds();
    int parts = 0;
    while (parts < PARTS && hear_part(zmq, now)) {
        parts++;
    }
    zmq->is_flooded = parts == PARTS;
    fsm_link_hello_pass_time(&zmq->hellos, now);
    fsm_link_gate_look(&zmq->gate, now);
}

static void say_hello(fsm_link_zmq *zmq)
{
    uint64_t now = milliseconds();
    for (uint8_t peer = 0u; peer < zmq->link->map->nodes; peer++) {
        uint8_t hello[FSM_LINK_HELLO];
        if (zmq->subscribers[peer] == NULL) {
            continue;
        }
        fsm_link_hello_write(&zmq->hellos, peer, hello);
        if (now - zmq->said[peer].at_ms < HELLO_MS &&
            memcmp(hello, zmq->said[peer].bytes, sizeof hello) == 0)
            continue;
        if (zmq_send(zmq->subscribers[peer], hello, sizeof hello, ZMQ_DONTWAIT) < 0) {
            continue;
        }
        zmq->said[peer].at_ms = now;
        memcpy(zmq->said[peer].bytes, hello, sizeof hello);
    }
}

/* ---- both ends -------------------------------------------------------------------------------- */

/* Without room, the listener counts the frame as lost. */
static void send_to(fsm_link_zmq *zmq, uint8_t peer, const fsm_link_frame *frame)
{
    const uint8_t *route = zmq->hellos.of[peer].route;
    int flags = ZMQ_DONTWAIT | ZMQ_SNDMORE;
    if (zmq_send(zmq->publisher, route, FSM_LINK_ROUTE, flags) >= 0) {
        (void)zmq_send(zmq->publisher, frame->bytes, frame->length, ZMQ_DONTWAIT);
    } else if (errno == EHOSTUNREACH) {
        fsm_link_hello_forget(&zmq->hellos, peer);
    }
}

static void send_all(fsm_link_zmq *zmq)
{
    fsm_link_frame frame;
    while (fsm_link_next(zmq->link, &frame)) {
        for (uint8_t peer = 0u; peer < zmq->link->map->nodes; peer++) {
            if (fsm_link_zmq_listener(zmq, peer) != 0u) {
                send_to(zmq, peer, &frame);
            }
        }
    }
}

typedef enum { NOTHING, SOMETHING, A_FRAME } taken;

/* Take one message of a peer. What is longer than a frame is cut off here, and malformed there; so
 * are the parts of a message of several. */
static taken take_one(fsm_link_zmq *zmq, uint8_t peer)
{
    uint8_t bytes[FSM_LINK_BYTES];
    int more = 0;
    size_t size = sizeof more;
    bool is_whole = !zmq->within[peer];
    int length = zmq_recv(zmq->subscribers[peer], bytes, sizeof bytes, ZMQ_DONTWAIT);
    if (length < 0) {
        return NOTHING;
    }
    (void)zmq_getsockopt(zmq->subscribers[peer], ZMQ_RCVMORE, &more, &size);
    zmq->within[peer] = more != 0;
    is_whole = is_whole && more == 0;
    return fsm_link_arrive(zmq->link, peer, bytes, is_whole ? (size_t)length : 0u) ? A_FRAME
                                                                                   : SOMETHING;
}

/* ---- deterministic: frames go and come in the caller's thread --------------------------------- */

static void use_sockets(fsm_link_zmq *zmq)
{
    see_listeners(zmq);
    say_hello(zmq);
}

static void *keeper(void *carrier)
{
    static const struct timespec while_idle = {0, PATROL_MS * 1000000L};
    fsm_link_zmq *zmq = carrier;
    bool is_flooded = false;
    while (fsm_shared_read(&zmq->stop) == 0u) {
        if (is_flooded) {
            (void)sched_yield();
        } else {
            (void)nanosleep(&while_idle, NULL);
        }
        (void)pthread_mutex_lock(&zmq->turn);
        use_sockets(zmq);
        is_flooded = zmq->is_flooded;
        (void)pthread_mutex_unlock(&zmq->turn);
    }
    return NULL;
}

static void wake_here(void *carrier, fsm_link *link)
{
    fsm_link_zmq *zmq = carrier;
    (void)link;
    (void)pthread_mutex_lock(&zmq->turn);
    see_listeners(zmq);
    send_all(zmq);
    (void)pthread_mutex_unlock(&zmq->turn);
}

static bool receive_until(fsm_link_zmq *zmq, uint8_t peer, uint64_t until)
{
    for (;;) {
        zmq_pollitem_t item = {zmq->subscribers[peer], 0, ZMQ_POLLIN, 0};
        taken found = take_one(zmq, peer);
        uint64_t now;
        if (found == A_FRAME) {
            return true;
        }
        now = milliseconds();
        if (now >= until) {
            return false;
        }
        if (found == NOTHING) {
            (void)zmq_poll(&item, 1, until - now < PATROL_MS ? (long)(until - now) : PATROL_MS);
        }
        use_sockets(zmq);
    }
}

static bool receive_here(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms)
{
    fsm_link_zmq *zmq = carrier;
    bool is_come;
    if (peer >= link->map->nodes || zmq->subscribers[peer] == NULL) {
        return false;
    }
    (void)pthread_mutex_lock(&zmq->turn);
    is_come = receive_until(zmq, peer, milliseconds() + timeout_ms);
    (void)pthread_mutex_unlock(&zmq->turn);
    return is_come;
}

static bool heard_by(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms)
{
    fsm_link_zmq *zmq = carrier;
    uint64_t until = milliseconds() + timeout_ms;
    (void)link;
    for (;;) {
        static const struct timespec soon = {0, 1000000};
        uint32_t listener;
        listener = fsm_link_zmq_listener(zmq, peer);
        if (listener != 0u && (session == 0u || listener == session)) {
            return true;
        }
        if (milliseconds() >= until) {
            return false;
        }
        (void)nanosleep(&soon, NULL);
    }
}

/* ---- threads ---------------------------------------------------------------------------------- */

static void wake_sender(void *carrier, fsm_link *link)
{
    fsm_link_zmq *zmq = carrier;
    (void)link;
    (void)sem_post(&zmq->work);
}

static void *sender(void *carrier)
{
    fsm_link_zmq *zmq = carrier;
    uint64_t looked = 0u; /* a look takes calls of the system: one each millisecond is enough */
    while (fsm_shared_read(&zmq->stop) == 0u) {
        struct timespec until;
        (void)clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += PATROL_MS * 1000000L;
        if (until.tv_nsec >= 1000000000L) {
            until.tv_nsec -= 1000000000L;
            until.tv_sec++;
        }
        if (!zmq->is_flooded) {
            (void)sem_timedwait(&zmq->work, &until);
        }
        if (zmq->is_flooded || milliseconds() != looked) {
            looked = milliseconds();
            see_listeners(zmq);
        }
        send_all(zmq);
    }
    send_all(zmq);
    return NULL;
}

/* A descriptor of ZeroMQ is ready once after each time that its socket had nothing more to take. To wait
 * for it takes two calls of the system for a frame; zmq_poll, which looks first and afterwards, six. */
static void *receiver(void *carrier)
{
    fsm_link_zmq *zmq = carrier;
    struct pollfd ready[FSM_LINK_NODES];
    uint8_t peers[FSM_LINK_NODES];
    nfds_t count = 0;
    memset(ready, 0, sizeof ready);
    for (uint8_t peer = 0u; peer < zmq->link->map->nodes; peer++) {
        size_t size = sizeof ready[count].fd;
        if (zmq->subscribers[peer] != NULL &&
            zmq_getsockopt(zmq->subscribers[peer], ZMQ_FD, &ready[count].fd, &size) == 0) {
            ready[count].events = POLLIN;
            peers[count] = peer;
            count++;
        }
    }
    while (fsm_shared_read(&zmq->stop) == 0u) {
        bool is_empty = true;
        say_hello(zmq);
        for (nfds_t i = 0; i < count; i++) {
            int burst = 0;
            while (burst < FSM_LINK_SLOTS && take_one(zmq, peers[i]) != NOTHING) {
                burst++;
            }
            is_empty = is_empty && burst < FSM_LINK_SLOTS;
        }
        fsm_link_pass_time(zmq->link);
        if (is_empty) {
            (void)poll(ready, count, zmq->link->faults != NULL ? 1 : PATROL_MS);
        }
    }
    return NULL;
}

/* ---- scheduling ------------------------------------------------------------------------------- */

enum { CPUS = 64 };

typedef struct {
    int priority;
    uint64_t cpus;
    int priority_error, cpus_error;
} scheduling;

/* Give a thread its priority and processors, and remember rejected settings. */
static void schedule(pthread_t thread, scheduling *wish)
{
    if (wish->priority > 0) {
        struct sched_param parameters;
        memset(&parameters, 0, sizeof parameters);
        parameters.sched_priority = wish->priority;
        wish->priority_error = pthread_setschedparam(thread, SCHED_FIFO, &parameters);
    }
    if (wish->cpus != 0u) {
#ifdef __linux__
        cpu_set_t set;
        CPU_ZERO(&set);
        for (size_t cpu = 0; cpu < CPUS; cpu++) {
            if ((wish->cpus >> cpu & 1u) != 0u) {
                CPU_SET(cpu, &set);
            }
        }
        wish->cpus_error = pthread_setaffinity_np(thread, sizeof set, &set);
#else
        wish->cpus_error = ENOSYS;
#endif
    }
}

static void *try_scheduling(void *wish)
{
    schedule(pthread_self(), wish);
    return NULL;
}

static void keep_errors(fsm_link_zmq *zmq, const scheduling *wish)
{
    if (wish->priority_error != 0) {
        zmq->priority_error = wish->priority_error;
    }
    if (wish->cpus_error != 0) {
        zmq->cpus_error = wish->cpus_error;
    }
}

/* Schedule ZeroMQ's threads. ZeroMQ ends the process if the system rejects that ("posix_assert"), so a
 * thread of our own tries first. */
static bool schedule_context(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    scheduling wish = {options->io_priority, options->cpus, 0, 0};
    pthread_t trial;
    bool is_set = true;
    if (wish.priority <= 0 && wish.cpus == 0u) {
        return true;
    }
    errno = pthread_create(&trial, NULL, try_scheduling, &wish);
    if (errno != 0) {
        return false;
    }
    (void)pthread_join(trial, NULL);
    keep_errors(zmq, &wish);
    if (wish.priority > 0 && wish.priority_error == 0) {
        is_set = zmq_ctx_set(zmq->context, ZMQ_THREAD_SCHED_POLICY, SCHED_FIFO) == 0 &&
                 zmq_ctx_set(zmq->context, ZMQ_THREAD_PRIORITY, wish.priority) == 0;
    }
    for (int cpu = 0; cpu < CPUS && is_set && wish.cpus_error == 0; cpu++) {
        if ((wish.cpus >> cpu & 1u) != 0u) {
            is_set = zmq_ctx_set(zmq->context, ZMQ_THREAD_AFFINITY_CPU_ADD, cpu) == 0;
        }
    }
    return is_set;
}

static int start_thread(fsm_link_zmq *zmq, pthread_t *thread, void *(*run)(void *), int priority,
                        uint64_t cpus)
{
    scheduling wish = {priority, cpus, 0, 0};
    int error = pthread_create(thread, NULL, run, zmq);
    if (error == 0) {
        schedule(*thread, &wish);
        keep_errors(zmq, &wish);
    }
    return error;
}

/* ---- opening and closing ---------------------------------------------------------------------- */

static bool set_number(void *socket, int option, int value)
{
    return zmq_setsockopt(socket, option, &value, sizeof value) == 0;
}

static bool set_common(void *socket, int linger, int to_send, int to_receive, int bytes)
{
    int64_t largest = bytes > SMALL ? bytes : SMALL;
    return set_number(socket, ZMQ_LINGER, linger) && set_number(socket, ZMQ_SNDHWM, to_send) &&
           set_number(socket, ZMQ_RCVHWM, to_receive) &&
           zmq_setsockopt(socket, ZMQ_MAXMSGSIZE, &largest, sizeof largest) == 0 &&
           set_number(socket, ZMQ_RECONNECT_IVL, RECONNECT_MS) &&
           set_number(socket, ZMQ_RECONNECT_IVL_MAX, RECONNECT_MOST_MS) &&
           set_number(socket, ZMQ_HANDSHAKE_IVL, GONE_MS) &&
           set_number(socket, ZMQ_TCP_MAXRT, GONE_MS);
}

static int most_frames(const fsm_link_zmq *zmq)
{
    return zmq->is_deterministic ? TOGETHER : 4 * FSM_LINK_SLOTS;
}

static bool set_key(void *socket, int option, const char *key)
{
    return zmq_setsockopt(socket, option, key, FSM_LINK_KEY) == 0;
}

static bool open_publisher(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    const char *at = options->bind != NULL ? options->bind
                                           : options->endpoints[zmq->link->map->node];
    zmq->failed = "the endpoint of this node";
    zmq->publisher = zmq_socket(zmq->context, ZMQ_ROUTER);
    if (zmq->publisher == NULL ||
        !set_common(zmq->publisher, LINGER_MS, most_frames(zmq), WAITING, SMALL) ||
        !set_number(zmq->publisher, ZMQ_ROUTER_MANDATORY, 1) || /* it says when a listener has gone */
        !fsm_link_gate_open(&zmq->gate, zmq->context, zmq->publisher))
        return false;
    if (options->public_keys != NULL &&
        (!set_number(zmq->publisher, ZMQ_CURVE_SERVER, 1) ||
         !set_key(zmq->publisher, ZMQ_CURVE_SECRETKEY, options->secret_key) ||
         zmq_setsockopt(zmq->publisher, ZMQ_ZAP_DOMAIN, "fsm", 3) != 0))
        return false;
    return zmq_bind(zmq->publisher, at) == 0;
}

static bool open_subscriber(fsm_link_zmq *zmq, const fsm_link_zmq_options *options, unsigned peer)
{
    void *subscriber = zmq_socket(zmq->context, ZMQ_DEALER);
    zmq->subscribers[peer] = subscriber;
    zmq->failed = "the connection to a peer";
    if (subscriber == NULL || !set_common(subscriber, 0, 1, TOGETHER, FSM_LINK_BYTES)) {
        return false;
    }
    if (options->public_keys != NULL &&
        (!set_key(subscriber, ZMQ_CURVE_SERVERKEY, options->public_keys[peer]) ||
         !set_key(subscriber, ZMQ_CURVE_PUBLICKEY, options->public_keys[zmq->link->map->node]) ||
         !set_key(subscriber, ZMQ_CURVE_SECRETKEY, options->secret_key)))
        return false;
    return zmq_connect(subscriber, options->endpoints[peer]) == 0;
}

static bool start_threads(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    zmq->transport.wake = zmq->is_deterministic ? wake_here : wake_sender;
    zmq->transport.receive = zmq->is_deterministic ? receive_here : NULL;
    zmq->transport.heard_by = heard_by;
    zmq->transport.is_proven = zmq->has_keys;
    fsm_link_attach(zmq->link, &zmq->transport, zmq);
    zmq->failed = "the threads";
    if (zmq->is_deterministic) {
        errno = pthread_mutex_init(&zmq->turn, NULL);
        zmq->has_turn = errno == 0;
        errno = zmq->has_turn ? pthread_create(&zmq->keeper, NULL, keeper, zmq) : errno;
        zmq->has_keeper = zmq->has_turn && errno == 0;
        return zmq->has_keeper;
    }
    if (sem_init(&zmq->work, 0, 0) != 0) {
        return false;
    }
    zmq->has_work = true;
    errno = start_thread(zmq, &zmq->sender, sender, options->send_priority,
                         options->cpus);
    zmq->has_sender = errno == 0;
    if (!zmq->has_sender) {
        return false;
    }
    errno = start_thread(zmq, &zmq->receiver, receiver, options->receive_priority,
                         options->cpus);
    zmq->has_receiver = errno == 0;
    return zmq->has_receiver;
}

/* Without keys whoever reaches an endpoint could listen, and speak for any node. */
static bool is_guarded(const fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    const fsm_link_map *map = zmq->link->map;
    if (options->public_keys != NULL || map->is_insecure) {
        return true;
    }
    for (unsigned node = 0u; node < map->nodes; node++) {
        if (options->endpoints[node] != NULL &&
            !fsm_link_zmq_is_loopback(options->endpoints[node]))
            return false;
    }
    return options->bind == NULL || fsm_link_zmq_is_loopback(options->bind);
}

static bool open_all(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    zmq->failed = "an endpoint beyond this computer without keys (insecure: true allows it)";
    if (!is_guarded(zmq, options)) {
        errno = EACCES;
        return false;
    }
    zmq->failed = "the source of random numbers";
    if (!fsm_link_hello_init(&zmq->hellos, zmq->link->map->node, zmq->link->map->nodes,
                             zmq->link->session))
        return false;
    zmq->failed = "the context of ZeroMQ";
    zmq->context = zmq_ctx_new();
    if (zmq->context == NULL || !schedule_context(zmq, options)) {
        return false;
    }
    zmq->failed = "the keys for CURVE";
    if (zmq->has_keys && !fsm_link_keys_open(&zmq->keys, zmq->context, zmq->link->map->nodes,
                                             options->public_keys))
        return false;
    if (!open_publisher(zmq, options)) {
        return false;
    }
    for (unsigned peer = 0u; peer < zmq->link->map->nodes; peer++) {
        if (peer != zmq->link->map->node && options->endpoints[peer] != NULL &&
            !open_subscriber(zmq, options, peer))
            return false;
    }
    return start_threads(zmq, options);
}

int fsm_link_zmq_open(fsm_link_zmq *zmq, fsm_link *link, const fsm_link_zmq_options *options)
{
    int error;
    memset(zmq, 0, sizeof *zmq);
    zmq->link = link;
    zmq->is_deterministic = options->is_deterministic;
    zmq->has_keys = options->public_keys != NULL;
    errno = 0;
    if (open_all(zmq, options)) {
        zmq->failed = NULL;
        return 0;
    }
    error = errno != 0 ? errno : EINVAL;
    const char *failed = zmq->failed;
    fsm_link_zmq_close(zmq);
    zmq->failed = failed;
    return error;
}

uint32_t fsm_link_zmq_listener(const fsm_link_zmq *zmq, uint8_t peer)
{
    return peer < FSM_LINK_NODES ? (uint32_t)fsm_shared_read(&zmq->hellos.of[peer].session)
                                 : 0u;
}

uint32_t fsm_link_zmq_dropped(const fsm_link_zmq *zmq)
{
    return (uint32_t)fsm_shared_read(&zmq->gate.dropped);
}

static void close_socket(void **socket)
{
    if (*socket != NULL) {
        (void)zmq_close(*socket);
    }
    *socket = NULL;
}

void fsm_link_zmq_close(fsm_link_zmq *zmq)
{
    fsm_link_attach(zmq->link, NULL, NULL);
    fsm_shared_write(&zmq->stop, 1u);
    if (zmq->has_sender) {
        (void)sem_post(&zmq->work);
        (void)pthread_join(zmq->sender, NULL);
    }
    if (zmq->has_receiver) {
        (void)pthread_join(zmq->receiver, NULL);
    }
    if (zmq->has_keeper) {
        (void)pthread_join(zmq->keeper, NULL);
    }
    if (zmq->has_turn) {
        (void)pthread_mutex_destroy(&zmq->turn);
    }
    fsm_link_gate_close(&zmq->gate);
    close_socket(&zmq->publisher);
    for (unsigned peer = 0u; peer < FSM_LINK_NODES; peer++) {
        close_socket(&zmq->subscribers[peer]);
    }
    fsm_link_keys_close(&zmq->keys);
    if (zmq->context != NULL) {
        (void)zmq_ctx_term(zmq->context);
    }
    zmq->context = NULL;
    if (zmq->has_work) {
        (void)sem_destroy(&zmq->work);
    }
    zmq->has_sender = zmq->has_receiver = false;
    zmq->has_work = zmq->has_keeper = zmq->has_turn = false;
}
