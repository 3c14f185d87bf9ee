/* fsm_link.h: messages between nodes: what a real-time loop does with a link, and never blocks.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * A node is a program with some of the machines of a system. `fsmkit compile` of a deployment writes
 * for the node `a` of the system Ring the files ring_a.h and ring_a.c, which do with a link what is
 * to be done; a host calls
 *
 *   static fsm_link link;                         large; no allocation, ever
 *   static fsm_link_zmq zmq;                      what carries the frames (fsm_link_zmq.h), or
 *                                                 fsm_link_local.h within one program
 *   static ring_a node;                           all machines of the node, as members by name
 *
 *   fsm_link_init(&link, &ring_a_map, session);   session: greater than that of the run before
 *   fsm_link_zmq_open(&zmq, &link, &options);
 *   ring_a_init(&node);
 *   node.link = &link;
 *   ring_a_start(&node, 0);
 *   once a cycle:
 *     feeder_post_arrived(&node.feeder);          what the controllers say
 *     node.feeder.in.pocket_occupied = ...;          what the sensors say
 *     ring_a_cycle(&node, now);                   what came in is posted, all machines run, what
 *                                                 they send to other nodes goes out
 *     if (fsm_link_silence(&link, RING_A_NODE_B) > 100) ...        cycles without a word of b
 *     if (fsm_link_count(&link, RING_A_NODE_B, FSM_LINK_LOST_EVENTS) > before) ...
 *
 * An event crosses once, in order, or is counted as lost by the receiver. A level (an output that
 * is wired to an input) is published every cycle, and only the last value is kept.
 *
 * The bytes of a frame are described in docs/reference/links.md. */
#ifndef FSM_LINK_H
#define FSM_LINK_H

#include "fsm_mailbox.h"
#include "fsm_watch.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- configuration: the same for all files of a program -------------------------------------- */

#ifndef FSM_LINK_BYTES /* of the largest frame; generated code says if it is not enough */
#define FSM_LINK_BYTES 128
#endif
#ifndef FSM_LINK_SLOTS /* frames of events that wait in each direction; a power of two */
#define FSM_LINK_SLOTS 256
#endif
#ifndef FSM_LINK_SESSIONS /* a peer that has shown no key can go on by so many at once */
#define FSM_LINK_SESSIONS 0x10000000u
#endif
#ifndef FSM_LINK_QUIET /* cycles without its present session, after which a peer may begin any */
#define FSM_LINK_QUIET 200u
#endif
#ifndef FSM_LINK_WATCHDOG_MS /* for a deployment that does not declare `links: watchdog` */
#define FSM_LINK_WATCHDOG_MS 100u
#endif
#ifndef FSM_LINK_NODES /* nodes of a deployment at most */
#define FSM_LINK_NODES 8
#endif

/* ---- frames ----------------------------------------------------------------------------------- */

#define FSM_LINK_VERSION 1u
#define FSM_LINK_HEADER 22u /* bytes before the payload */
#define FSM_LINK_LEVELS 0u  /* the number of the message with all levels of its sender */

typedef struct {
    uint32_t number; /* of an event: which one since the start, from 0, with those refused */
    uint16_t length;
    uint8_t bytes[FSM_LINK_BYTES];
} fsm_link_frame;

/* A message of the event map: who sends it, to whom, and how many bytes its payload has. */
typedef struct {
    uint8_t sender;
    uint8_t receiver;
    uint16_t size;
} fsm_link_message;

/* The event map as a node knows it; generated. */
typedef struct {
    uint32_t hash; /* of the whole map: the same on all nodes that understand each other */
    uint8_t node;  /* this one, by its place in the deployment */
    uint8_t nodes;
    uint16_t messages;               /* events are numbered 1..messages */
    const fsm_link_message *message; /* [number - 1] */
    const uint16_t *levels;          /* [node]: bytes of its levels */
    const char *const *names;        /* [node] */
    /* Whether all values are of their types; payload has the right size. */
    bool (*is_valid)(uint8_t sender, uint16_t message, const uint8_t *payload);
    uint32_t every; /* cycles from levels to levels */
    bool is_insecure; /* endpoints beyond this computer may go without keys */
    uint32_t watchdog_ms; /* see fsm_link_watch; 0: FSM_LINK_WATCHDOG_MS */
} fsm_link_map;

/* ---- what is counted -------------------------------------------------------------------------- */

/* Of a peer, since the link was made. */
typedef enum {
    FSM_LINK_FRAMES,      /* came in, in the present session of the peer; faults count as well */
    FSM_LINK_LOST_FRAMES, /* never came, or came when a later one had come */
    FSM_LINK_LOST_EVENTS, /* the events among them, and those that found a ring full at the peer */
    FSM_LINK_MISSED,      /* events before the first frame that came, of a peer that was first */
    FSM_LINK_LATE,        /* of another session, or after a later one: dropped, for order */
    FSM_LINK_DOUBLED,     /* came again: dropped */
    FSM_LINK_OVERFLOW,    /* found the ring full here: dropped */
    FSM_LINK_RESTARTS,    /* sessions after the first */
    FSM_LINK_COUNTS
} fsm_link_counter;

/* Of the link as a whole. */
typedef enum {
    FSM_LINK_SENT,      /* frames that were handed to what carries them */
    FSM_LINK_REFUSED,   /* events that found the ring to the worker full: the peers count them */
    FSM_LINK_MALFORMED, /* frames that are none, are cut off, or carry what their type forbids */
    FSM_LINK_FOREIGN,   /* frames of another version or map, or not of the node they came from */
    FSM_LINK_BUS_ERRORS, /* error frames of buses that carry frames */
    FSM_LINK_BUS_OFF,   /* those that say that the controller has left its bus */
    FSM_LINK_TOTALS
} fsm_link_total;

typedef struct fsm_link fsm_link;

uint32_t fsm_link_count(const fsm_link *link, uint8_t peer, fsm_link_counter what);
uint32_t fsm_link_counted(const fsm_link *link, fsm_link_total what);

/* The present session of a peer; 0 if it was never heard. */
uint32_t fsm_link_session(const fsm_link *link, uint8_t peer);

/* How many cycles (calls of fsm_link_begin, which X_cycle makes) ago the last frame of a peer was
 * seen. A peer publishes every cycle, or as often as the deployment says, so that silence means that
 * it, or the link, is dead. Of one that was never heard: the cycles since the link was made. */
uint32_t fsm_link_silence(const fsm_link *link, uint8_t peer);

/* ---- a loop that hangs --------------------------------------------------------------------------
 * Frames leave when the loop completes a cycle. Whatever a carrier sends without the loop (cyclic
 * messages of CAN, hellos, diagnostics) depends on this watch, so that a hung loop falls silent. */

/* Start to watch the loop of a link, with the bound of the deployment. */
void fsm_link_watch(const fsm_link *link, fsm_watch *watch, uint64_t now_ms);

/* Return whether the loop may be represented as alive: it has completed a cycle within the bound. A
 * carrier calls this at least every fsm_watch_every(watch) ms, from the thread that sends. False
 * before the first cycle. */
bool fsm_link_is_live(const fsm_link *link, fsm_watch *watch, uint64_t now_ms);

/* Return how many cycles the loop has completed, modulo 2^32. */
uint32_t fsm_link_completed(const fsm_link *link);

/* ---- making a link ---------------------------------------------------------------------------- */

/* Make a link that nothing carries yet. `session` tells this run of the node from those before: it
 * must be greater (modulo 2^32), for instance the time in milliseconds, or a counter of starts that
 * is kept; without keys by no more than FSM_LINK_SESSIONS. Peers take any other for late until they
 * have not heard the present one for FSM_LINK_QUIET of their cycles. 0 is none. */
void fsm_link_init(fsm_link *link, const fsm_link_map *map, uint32_t session);

/* Publish levels in every n-th cycle, not as the deployment says. Before the first cycle. */
void fsm_link_publish_every(fsm_link *link, uint32_t cycles);

/* ---- deterministic co-simulation --------------------------------------------------------------
 * Whoever steps the nodes tells each, before a step, how many frames every other has sent so far:
 * what fsm_link_counted(.., FSM_LINK_SENT) was there after its last step. A transport opened as
 * deterministic sends and receives within the calls of the loop only, so that a step sees the same
 * messages in every run. Frames dropped by seeded faults count as received. */

typedef enum {
    FSM_LINK_READY,
    FSM_LINK_TIMEOUT, /* fsm_link_explain says who is missing */
    FSM_LINK_BEYOND,  /* more came than was told: who tells is wrong, or the link is not its own */
    FSM_LINK_DEAF     /* the transport is not deterministic */
} fsm_link_waited;

/* Block until `frames` frames of the peer's session have come in; 0 for whichever session it has: if
 * more have come already, then perhaps of an old one, and a new one is waited for. The time is that
 * without any frame of the peer. */
fsm_link_waited fsm_link_await(fsm_link *link, uint8_t peer, uint32_t session, uint32_t frames,
                               uint32_t timeout_ms);

/* Block until a peer listens to this node in this session, 0 for whichever it has; or until every
 * other node does, before the first step. For threaded transports as well. A peer listens when it
 * has shown that it is the one at its endpoint, and with keys, that it has the key. */
fsm_link_waited fsm_link_connect_to(fsm_link *link, uint8_t peer, uint32_t session,
                                    uint32_t timeout_ms);
fsm_link_waited fsm_link_connect(fsm_link *link, uint32_t timeout_ms);

/* Write one line on what the last of these waited for, cut to `room` bytes with the zero. */
void fsm_link_explain(const fsm_link *link, char *text, size_t room);

/* ---- seeded faults, for tests ------------------------------------------------------------------
 * Between what arrives and what is taken in. Chances are in 1/65536; the same seed does the same to
 * the same frames. */

#ifndef FSM_LINK_HELD
#define FSM_LINK_HELD 64 /* frames that are delayed at a time; one more, and the oldest goes on */
#endif

typedef struct {
    /* Set these before the first frame; the rest is zero. */
    uint64_t seed;
    uint32_t loss;
    uint32_t duplication;
    uint32_t delay;        /* the chance; frames of the same peer wait behind a delayed one */
    uint32_t delay_cycles; /* for how many cycles of the receiver */
    /* Counted, by the thread that receives. */
    uint32_t lost;
    uint32_t duplicated;
    uint32_t delayed;
    /* Its own. */
    fsm_shared is_cut;
    bool is_seeded;
    uint64_t state[FSM_LINK_NODES];
    uint32_t due[FSM_LINK_HELD];
    fsm_link_frame held[FSM_LINK_HELD];
    uint32_t count;
} fsm_link_faults;

/* Lose everything, or no more, from now on: a dead link. */
void fsm_link_cut(fsm_link_faults *faults, bool is_cut);

/* Let what arrives pass these faults; NULL: none. Before the transport is opened. */
void fsm_link_set_faults(fsm_link *link, fsm_link_faults *faults);

/* ---- what generated code calls, in the loop: no call blocks ----------------------------------- */

/* A cycle begins: see what has come in. */
void fsm_link_begin(fsm_link *link);

/* The oldest event that came in before this cycle, NULL if there is none; then take it away. */
const fsm_link_frame *fsm_link_front(fsm_link *link);
uint16_t fsm_link_message_of(const fsm_link_frame *frame);
void fsm_link_release(fsm_link *link);

/* The payload of the levels of a peer, if new ones came since the last call; else NULL. */
const uint8_t *fsm_link_levels(fsm_link *link, uint8_t peer);

/* Make room for an event; write its payload to the address returned; put it. NULL: there is none,
 * the event is counted and lost. */
uint8_t *fsm_link_claim(fsm_link *link, uint16_t message);
void fsm_link_put(fsm_link *link);

/* Where to write the payload of the levels; NULL if it is not the cycle for it. */
uint8_t *fsm_link_levels_out(fsm_link *link);

/* A cycle ends: what was put, and the levels, go out. */
void fsm_link_end(fsm_link *link);

/* ---- what a transport calls ------------------------------------------------------------------- */

typedef struct {
    /* Frames wait in the ring. In a threaded transport: wake it. Never blocks there. */
    void (*wake)(void *carrier, fsm_link *link);
    /* Deterministic transports, else NULL: block until one frame of the peer has gone through
     * fsm_link_arrive; false when the time is over. */
    bool (*receive)(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms);
    /* Block until the peer listens, in this session if it is not 0; false when the time is over. */
    bool (*heard_by)(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms);
    bool is_proven; /* who sends is made sure, by a key or because all is one program */
} fsm_link_transport;

void fsm_link_attach(fsm_link *link, const fsm_link_transport *transport, void *carrier);

/* Beside the transport (fsm_link_fan.h): what sees each frame that goes out, in the thread of
 * fsm_link_next, and lets the threads that call fsm_link_arrive take turns. */
typedef struct {
    void (*take)(void *fan, const fsm_link_frame *frame);
    void (*enter)(void *fan);
    void (*leave)(void *fan);
} fsm_link_beside;

void fsm_link_set_beside(fsm_link *link, const fsm_link_beside *beside, void *fan);

/* The next frame to send, complete; false if there is none. One thread only. */
bool fsm_link_next(fsm_link *link, fsm_link_frame *frame);

/* Bytes came from the endpoint of a peer, perhaps a frame of it, perhaps not; whether they were one
 * of its present session, also if faults drop it. One thread only, unless there is a fan; it may be
 * another than that of fsm_link_next. */
bool fsm_link_arrive(fsm_link *link, uint8_t peer, const uint8_t *bytes, size_t length);

/* How many events that arrive the link has room for; other threads that call fsm_link_arrive, and
 * frames that seeded faults delay, may take it first. */
uint32_t fsm_link_room(const fsm_link *link);

/* What stands before the payload of a frame. */
typedef struct {
    uint8_t sender;
    uint32_t hash, session, sequence, events;
    uint16_t message;
} fsm_link_head;

/* The same of a frame that a carrier makes of other bytes; false as well if it is too long. */
bool fsm_link_arrive_as(fsm_link *link, const fsm_link_head *head, const uint8_t *payload,
                        size_t size);

/* An error frame of a bus has come. */
void fsm_link_bus_error(fsm_link *link, bool is_bus_off);

/* Let delayed frames go on whose time has come: now and then, by the thread of fsm_link_arrive. */
void fsm_link_pass_time(fsm_link *link);

/* ---- little-endian integers ------------------------------------------------------------------- */

static inline void fsm_link_put_bytes(uint8_t *to, uint64_t value, unsigned size)
{
    for (unsigned i = 0u; i < size; i++) {
        to[i] = (uint8_t)(value >> (8u * i));
    }
}

static inline uint64_t fsm_link_get_bytes(const uint8_t *from, unsigned size)
{
    uint64_t value = 0u;
    for (unsigned i = 0u; i < size; i++) {
        value |= (uint64_t)from[i] << (8u * i);
    }
    return value;
}

/* The same with the sign of the highest of `size` bytes. */
static inline int64_t fsm_link_get_signed(const uint8_t *from, unsigned size)
{
    uint64_t value = fsm_link_get_bytes(from, size);
    uint64_t sign = (uint64_t)1 << (8u * size - 1u);
    if ((value & sign) == 0u) {
        return (int64_t)value;
    }
    return -(int64_t)(~value & (sign - 1u)) - 1;
}

/* IEEE 754, as its bits. */
void fsm_link_put_float(uint8_t *to, float value);
float fsm_link_get_float(const uint8_t *from);
void fsm_link_put_double(uint8_t *to, double value);
double fsm_link_get_double(const uint8_t *from);

/* ---- the link itself: nothing here is for hosts ------------------------------------------------ */

typedef struct {
    fsm_ring ring;
    fsm_link_frame slots[FSM_LINK_SLOTS];
} fsm_link_ring;

/* The last of what one side writes: three places, one of each side's own, one between them. */
typedef struct {
    fsm_shared middle; /* the place between, with FSM_LINK_NEW if it was written since */
    uint8_t writes;    /* the writer's place */
    uint8_t reads;     /* the reader's place */
    fsm_link_frame places[3];
} fsm_link_latest;

typedef struct {
    fsm_shared counts[FSM_LINK_COUNTS];
    fsm_shared session;  /* arriving; 0: never heard */
    fsm_shared heard;    /* frames of all sessions, faults left out */
    fsm_shared taken;    /* the session of the last frame that was taken in */
    uint32_t spoke;      /* the cycle of the last frame of the present session */
    uint32_t sequence;   /* of the next frame */
    uint32_t events;     /* of the next event */
    uint64_t window;     /* bit k: frame `sequence - 1 - k` came in */
    uint32_t seen;       /* `heard` when the loop last looked */
    uint32_t seen_cycle; /* and when that was other than before */
    fsm_link_latest levels;
} fsm_link_peer;

struct fsm_link {
    const fsm_link_map *map;
    const fsm_link_transport *transport;
    void *carrier;
    const fsm_link_beside *beside; /* NULL: none */
    void *fan;
    fsm_link_faults *faults;
    uint32_t session;
    uint32_t every;
    fsm_shared cycle;
    fsm_shared completed; /* cycles that have ended */
    fsm_shared totals[FSM_LINK_TOTALS];
    uint32_t put;       /* events put or refused; these three are the loop's own */
    uint32_t put_before; /* when the last cycle ended */
    uint32_t pending;   /* put in this cycle: not to be seen before it ends */
    bool has_levels;
    uint32_t arrived;   /* events of this cycle that are still to be taken out of `in` */
    uint32_t sequence;  /* of the next frame to send: the sender's own */
    uint32_t events;    /* of the next event to send */
    uint8_t waited_peer; /* for fsm_link_explain */
    uint32_t waited_session;
    uint32_t waited_frames;
    bool waited_for_listener;
    fsm_link_ring out;
    fsm_link_ring in;
    fsm_link_latest levels;
    fsm_link_peer peers[FSM_LINK_NODES];
};

#ifdef __cplusplus
}
#endif

#endif
