/* fsm_link_zmq.c: see fsm_link_zmq.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_zmq.h"

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <zmq.h>

enum {
    PATROL_MS = 10,    /* from look to look at what nobody wakes a thread for */
    RECONNECT_MS = 10, /* after a peer has gone; longer and longer, up to the next */
    RECONNECT_MOST_MS = 200,
    HEARTBEAT_MS = 500,
    GONE_MS = 2000, /* without a sign of life a connection is given up, and made again */
    LINGER_MS = 500,
    TOPIC = 6 /* a subscription nothing is sent to, which names the subscriber and its session */
};
#define TOPIC_MARK 0x3Fu /* no frame begins with it */

/* ---- both ends -------------------------------------------------------------------------------- */

/* See who came and who went: a byte 1 or 0, and what was subscribed to. */
static void see_listeners(fsm_link_zmq *zmq)
{
    uint8_t said[1 + TOPIC];
    int length;
    while ((length = zmq_recv(zmq->publisher, said, sizeof said, ZMQ_DONTWAIT)) >= 0) {
        if (length != (int)sizeof said || said[1] != TOPIC_MARK || said[2] >= FSM_LINK_NODES)
            continue;
        fsm_shared *listener = &zmq->listeners[said[2]];
        FSM_INDEX session = (FSM_INDEX)fsm_link_get_bytes(said + 3, 4u);
        if (said[0] == 1u)
            fsm_shared_write(listener, session);
        else if (fsm_shared_own(listener) == session)
            fsm_shared_write(listener, 0u);
    }
}

static void send_all(fsm_link_zmq *zmq)
{
    fsm_link_frame frame;
    see_listeners(zmq);
    while (fsm_link_next(zmq->link, &frame))
        (void)zmq_send(zmq->publisher, frame.bytes, frame.length, ZMQ_DONTWAIT);
}

/* Take one message of a peer; false if there is none. What is longer than a frame is cut off here,
 * and malformed there. */
static bool take_one(fsm_link_zmq *zmq, void *subscriber)
{
    uint8_t bytes[FSM_LINK_BYTES];
    int length = zmq_recv(subscriber, bytes, sizeof bytes, ZMQ_DONTWAIT);
    if (length < 0)
        return false;
    fsm_link_arrive(zmq->link, bytes, (size_t)length);
    return true;
}

static uint64_t milliseconds(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000u + (uint64_t)now.tv_nsec / 1000000u;
}

/* ---- deterministic: frames go and come in the caller's thread --------------------------------- */

/* A socket subscribes again to a peer that came back, and sees who listens, only when it is used. */
static void use_sockets(fsm_link_zmq *zmq)
{
    see_listeners(zmq);
    for (unsigned peer = 0u; peer < zmq->link->map->nodes; peer++) {
        int events = 0;
        size_t size = sizeof events;
        if (zmq->subscribers[peer] != NULL)
            (void)zmq_getsockopt(zmq->subscribers[peer], ZMQ_EVENTS, &events, &size);
    }
}

static void *keeper(void *carrier)
{
    static const struct timespec while_idle = {0, PATROL_MS * 1000000L};
    fsm_link_zmq *zmq = carrier;
    while (fsm_shared_read(&zmq->stop) == 0u) {
        (void)nanosleep(&while_idle, NULL);
        (void)pthread_mutex_lock(&zmq->turn);
        use_sockets(zmq);
        (void)pthread_mutex_unlock(&zmq->turn);
    }
    return NULL;
}

static void wake_here(void *carrier, fsm_link *link)
{
    fsm_link_zmq *zmq = carrier;
    (void)link;
    (void)pthread_mutex_lock(&zmq->turn);
    send_all(zmq);
    (void)pthread_mutex_unlock(&zmq->turn);
}

static bool receive_until(fsm_link_zmq *zmq, uint8_t peer, uint64_t until)
{
    for (;;) {
        zmq_pollitem_t item = {zmq->subscribers[peer], 0, ZMQ_POLLIN, 0};
        uint64_t now;
        if (take_one(zmq, zmq->subscribers[peer]))
            return true;
        now = milliseconds();
        if (now >= until)
            return false;
        (void)zmq_poll(&item, 1, until - now < PATROL_MS ? (long)(until - now) : PATROL_MS);
        use_sockets(zmq);
    }
}

static bool receive_here(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms)
{
    fsm_link_zmq *zmq = carrier;
    bool is_come;
    if (peer >= link->map->nodes || zmq->subscribers[peer] == NULL)
        return false;
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
        if (listener != 0u && (session == 0u || listener == session))
            return true;
        if (milliseconds() >= until)
            return false;
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
    while (fsm_shared_read(&zmq->stop) == 0u) {
        struct timespec until;
        (void)clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += PATROL_MS * 1000000L;
        if (until.tv_nsec >= 1000000000L) {
            until.tv_nsec -= 1000000000L;
            until.tv_sec++;
        }
        (void)sem_timedwait(&zmq->work, &until);
        send_all(zmq);
    }
    send_all(zmq);
    return NULL;
}

static void *receiver(void *carrier)
{
    fsm_link_zmq *zmq = carrier;
    zmq_pollitem_t items[FSM_LINK_NODES];
    int count = 0;
    memset(items, 0, sizeof items);
    for (unsigned peer = 0u; peer < zmq->link->map->nodes; peer++) {
        if (zmq->subscribers[peer] != NULL) {
            items[count].socket = zmq->subscribers[peer];
            items[count].events = ZMQ_POLLIN;
            count++;
        }
    }
    while (fsm_shared_read(&zmq->stop) == 0u) {
        (void)zmq_poll(items, count, zmq->link->faults != NULL ? 1 : PATROL_MS);
        for (int i = 0; i < count; i++) {
            for (int burst = 0; burst < FSM_LINK_SLOTS && take_one(zmq, items[i].socket); burst++)
                ;
        }
        fsm_link_pass_time(zmq->link);
    }
    return NULL;
}

static int start_thread(fsm_link_zmq *zmq, pthread_t *thread, void *(*run)(void *), int priority)
{
    int error = pthread_create(thread, NULL, run, zmq);
    if (error == 0 && priority > 0) {
        struct sched_param scheduling;
        memset(&scheduling, 0, sizeof scheduling);
        scheduling.sched_priority = priority;
        int refused = pthread_setschedparam(*thread, SCHED_FIFO, &scheduling);
        if (refused != 0)
            zmq->priority_error = refused;
    }
    return error;
}

/* ---- authentication: ZAP (rfc.zeromq.org/spec/27) --------------------------------------------- */

enum { ZAP_FRAMES = 7, ZAP_BYTES = 64 };

/* Answer one request for admission: version, id, domain, address, identity, mechanism, key. */
static void answer_door(fsm_link_zmq *zmq)
{
    uint8_t parts[ZAP_FRAMES][ZAP_BYTES] = {{0}};
    int lengths[ZAP_FRAMES] = {0};
    int count = 0, more = 1;
    bool is_known = false;
    while (more != 0) {
        uint8_t rest[ZAP_BYTES];
        size_t size = sizeof more;
        uint8_t *into = count < ZAP_FRAMES ? parts[count] : rest;
        int length = zmq_recv(zmq->door, into, ZAP_BYTES, 0);
        if (length < 0)
            return;
        if (count < ZAP_FRAMES)
            lengths[count] = length;
        count++;
        if (zmq_getsockopt(zmq->door, ZMQ_RCVMORE, &more, &size) != 0)
            return;
    }
    if (count == ZAP_FRAMES && lengths[6] == 32 && lengths[5] == 5 &&
        memcmp(parts[5], "CURVE", 5) == 0) {
        for (unsigned node = 0u; node < zmq->link->map->nodes; node++)
            is_known = is_known || memcmp(zmq->keys[node], parts[6], 32) == 0;
    }
    (void)zmq_send(zmq->door, "1.0", 3, ZMQ_SNDMORE);
    (void)zmq_send(zmq->door, parts[1],
                   count > 1 && lengths[1] <= ZAP_BYTES ? (size_t)lengths[1] : 0u, ZMQ_SNDMORE);
    (void)zmq_send(zmq->door, is_known ? "200" : "400", 3, ZMQ_SNDMORE);
    (void)zmq_send(zmq->door, "", 0, ZMQ_SNDMORE);
    (void)zmq_send(zmq->door, "", 0, ZMQ_SNDMORE);
    (void)zmq_send(zmq->door, "", 0, 0);
}

static void *doorman(void *carrier)
{
    fsm_link_zmq *zmq = carrier;
    while (fsm_shared_read(&zmq->stop) == 0u) {
        zmq_pollitem_t item = {zmq->door, 0, ZMQ_POLLIN, 0};
        if (zmq_poll(&item, 1, PATROL_MS) > 0)
            answer_door(zmq);
    }
    return NULL;
}

bool fsm_link_zmq_key(const char *path, const char *kind, char key[FSM_LINK_KEY])
{
    char line[256];
    bool is_found = false;
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return false;
    while (!is_found && fgets(line, sizeof line, file) != NULL) {
        const char *at = line + strspn(line, " \t");
        if (strncmp(at, kind, strlen(kind)) != 0)
            continue;
        at = strchr(at, '"');
        if (at != NULL && strcspn(at + 1, "\"") == FSM_LINK_KEY - 1) {
            memcpy(key, at + 1, FSM_LINK_KEY - 1);
            key[FSM_LINK_KEY - 1] = '\0';
            is_found = true;
        }
    }
    (void)fclose(file);
    return is_found;
}

/* ---- opening and closing ---------------------------------------------------------------------- */

static bool set_number(void *socket, int option, int value)
{
    return zmq_setsockopt(socket, option, &value, sizeof value) == 0;
}

static bool set_common(void *socket, bool is_deterministic)
{
    int most = is_deterministic ? 0 : 4 * FSM_LINK_SLOTS; /* 0: whatever comes is kept */
    return set_number(socket, ZMQ_LINGER, is_deterministic ? LINGER_MS : 0) &&
           set_number(socket, ZMQ_SNDHWM, most) && set_number(socket, ZMQ_RCVHWM, most) &&
           set_number(socket, ZMQ_RECONNECT_IVL, RECONNECT_MS) &&
           set_number(socket, ZMQ_RECONNECT_IVL_MAX, RECONNECT_MOST_MS) &&
           set_number(socket, ZMQ_HEARTBEAT_IVL, HEARTBEAT_MS) &&
           set_number(socket, ZMQ_HEARTBEAT_TIMEOUT, GONE_MS);
}

static bool set_key(void *socket, int option, const char *key)
{
    return zmq_setsockopt(socket, option, key, FSM_LINK_KEY) == 0;
}

static bool open_door(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    zmq->failed = "the keys for CURVE";
    for (unsigned node = 0u; node < zmq->link->map->nodes; node++) {
        if (zmq_z85_decode(zmq->keys[node], options->public_keys[node]) == NULL)
            return false;
    }
    zmq->failed = "the check of keys";
    zmq->door = zmq_socket(zmq->context, ZMQ_REP);
    if (zmq->door == NULL || !set_number(zmq->door, ZMQ_LINGER, 0) ||
        zmq_bind(zmq->door, "inproc://zeromq.zap.01") != 0)
        return false;
    errno = pthread_create(&zmq->doorman, NULL, doorman, zmq);
    zmq->has_doorman = errno == 0;
    return zmq->has_doorman;
}

static bool open_publisher(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    const char *at = options->bind != NULL ? options->bind
                                           : options->endpoints[zmq->link->map->node];
    zmq->failed = "the endpoint of this node";
    zmq->publisher = zmq_socket(zmq->context, ZMQ_XPUB);
    if (zmq->publisher == NULL || !set_common(zmq->publisher, options->is_deterministic) ||
        !set_number(zmq->publisher, ZMQ_XPUB_VERBOSE, 1))
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
    uint8_t topic[TOPIC] = {TOPIC_MARK, zmq->link->map->node};
    void *subscriber = zmq_socket(zmq->context, ZMQ_SUB);
    zmq->subscribers[peer] = subscriber;
    zmq->failed = "the connection to a peer";
    fsm_link_put_bytes(topic + 2, zmq->link->session, 4u);
    if (subscriber == NULL || !set_common(subscriber, options->is_deterministic) ||
        zmq_setsockopt(subscriber, ZMQ_SUBSCRIBE, "FK", 2) != 0 ||
        zmq_setsockopt(subscriber, ZMQ_SUBSCRIBE, topic, sizeof topic) != 0)
        return false;
    if (options->public_keys != NULL &&
        (!set_key(subscriber, ZMQ_CURVE_SERVERKEY, options->public_keys[peer]) ||
         !set_key(subscriber, ZMQ_CURVE_PUBLICKEY, options->public_keys[zmq->link->map->node]) ||
         !set_key(subscriber, ZMQ_CURVE_SECRETKEY, options->secret_key)))
        return false;
    return zmq_connect(subscriber, options->endpoints[peer]) == 0;
}

static bool start_threads(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    static const fsm_link_transport threaded = {wake_sender, NULL, heard_by};
    static const fsm_link_transport deterministic = {wake_here, receive_here, heard_by};
    fsm_link_attach(zmq->link, zmq->is_deterministic ? &deterministic : &threaded, zmq);
    zmq->failed = "the threads";
    if (zmq->is_deterministic) {
        errno = pthread_mutex_init(&zmq->turn, NULL);
        zmq->has_turn = errno == 0;
        errno = zmq->has_turn ? pthread_create(&zmq->keeper, NULL, keeper, zmq) : errno;
        zmq->has_keeper = zmq->has_turn && errno == 0;
        return zmq->has_keeper;
    }
    if (sem_init(&zmq->work, 0, 0) != 0)
        return false;
    zmq->has_work = true;
    errno = start_thread(zmq, &zmq->sender, sender, options->send_priority);
    zmq->has_sender = errno == 0;
    if (!zmq->has_sender)
        return false;
    errno = start_thread(zmq, &zmq->receiver, receiver, options->receive_priority);
    zmq->has_receiver = errno == 0;
    return zmq->has_receiver;
}

static bool open_all(fsm_link_zmq *zmq, const fsm_link_zmq_options *options)
{
    zmq->failed = "the context of ZeroMQ";
    zmq->context = zmq_ctx_new();
    if (zmq->context == NULL)
        return false;
    if (options->public_keys != NULL && !open_door(zmq, options))
        return false;
    if (!open_publisher(zmq, options))
        return false;
    for (unsigned peer = 0u; peer < zmq->link->map->nodes; peer++) {
        if (peer != zmq->link->map->node && !open_subscriber(zmq, options, peer))
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
    return peer < FSM_LINK_NODES ? (uint32_t)fsm_shared_read(&zmq->listeners[peer]) : 0u;
}

static void close_socket(void **socket)
{
    if (*socket != NULL)
        (void)zmq_close(*socket);
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
    if (zmq->has_receiver)
        (void)pthread_join(zmq->receiver, NULL);
    if (zmq->has_keeper)
        (void)pthread_join(zmq->keeper, NULL);
    if (zmq->has_turn)
        (void)pthread_mutex_destroy(&zmq->turn);
    close_socket(&zmq->publisher);
    for (unsigned peer = 0u; peer < FSM_LINK_NODES; peer++)
        close_socket(&zmq->subscribers[peer]);
    if (zmq->has_doorman)
        (void)pthread_join(zmq->doorman, NULL);
    close_socket(&zmq->door);
    if (zmq->context != NULL)
        (void)zmq_ctx_term(zmq->context);
    zmq->context = NULL;
    if (zmq->has_work)
        (void)sem_destroy(&zmq->work);
    zmq->has_sender = zmq->has_receiver = zmq->has_doorman = false;
    zmq->has_work = zmq->has_keeper = zmq->has_turn = false;
}
