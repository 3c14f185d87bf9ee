/* fsm_link.h: messages between nodes, for real-time loops: no call in the loop blocks.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * A node is a program with some of the machines of a system. `fsmkit compile` of a deployment writes
 * for the node `a` of the system Ring the files ring_a.h and ring_a.c, which use a link; a host
 * calls
 *
 *   static fsm_link link;                         large; nothing is allocated
 *   static fsm_link_zmq zmq;                      the transport (fsm_link_zmq.h), or
 *                                                 fsm_link_local.h within one program
 *   static ring_a node;                           all machines of the node, as members by name
 *
 *   fsm_link_init(&link, &ring_a_map, session);   session: greater than that of the last run
 *   fsm_link_zmq_open(&zmq, &link, &options);
 *   ring_a_init(&node);
 *   node.link = &link;
 *   ring_a_start(&node, 0);
 *   once a cycle:
 *     feeder_post_arrived(&node.feeder);          events of the controllers
 *     node.feeder.in.pocket_occupied = ...;          values of the sensors
 *     ring_a_cycle(&node, now);                   posts received events, runs all machines, and
 *                                                 sends their events to other nodes
 *     if (fsm_link_silence(&link, RING_A_NODE_B) > 100) ...        cycles without a frame of b
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

#ifndef FSM_LINK_BYTES /* size of the largest frame; generated code checks it */
#define FSM_LINK_BYTES 128
#endif
#ifndef FSM_LINK_SLOTS /* frames of events queued in each direction; a power of two */
#define FSM_LINK_SLOTS 256
#endif
#ifndef FSM_LINK_SESSIONS /* sessions that a peer without a key may advance immediately */
#define FSM_LINK_SESSIONS 0x10000000u
#endif
#ifndef FSM_LINK_QUIET /* silent cycles of the present session after which a peer may start any other */
#define FSM_LINK_QUIET 200u
#endif
#ifndef FSM_LINK_WATCHDOG_MS /* for a deployment that does not declare `links: watchdog` */
#define FSM_LINK_WATCHDOG_MS 100u
#endif
#ifndef FSM_LINK_NODES /* maximum number of nodes of a deployment */
#define FSM_LINK_NODES 8
#endif

/* ---- frames ----------------------------------------------------------------------------------- */

#define FSM_LINK_VERSION 1u
#define FSM_LINK_HEADER 22u /* bytes before the payload */
#define FSM_LINK_LEVELS 0u  /* the number of the message with all levels of its sender */

typedef struct {
    uint32_t number; /* of an event: its index since the start, from 0, including rejected ones */
    uint16_t length;
    uint8_t bytes[FSM_LINK_BYTES];
} fsm_link_frame;

/* A message of the event map: sender, receiver, and size of the payload in bytes. */
typedef struct {
    uint8_t sender;
    uint8_t receiver;
    uint16_t size;
} fsm_link_message;

/* The event map of a node; generated. */
typedef struct {
    uint32_t hash; /* of the whole map: equal on all compatible nodes */
    uint8_t node;  /* this node, by its index in the deployment */
    uint8_t nodes;
    uint16_t messages;               /* events are numbered 1..messages */
    const fsm_link_message *message; /* [number - 1] */
    const uint16_t *levels;          /* [node]: bytes of its levels */
    const char *const *names;        /* [node] */
    /* Return whether all values are of their types; payload has the right size. */
    bool (*is_valid)(uint8_t sender, uint16_t message, const uint8_t *payload);
    uint32_t every; /* cycles between two frames of levels */
    bool is_insecure; /* endpoints on other computers need no keys */
    uint32_t watchdog_ms; /* see fsm_link_watch; 0: FSM_LINK_WATCHDOG_MS */
} fsm_link_map;

/* ---- counters -------------------------------------------------------------------------- */

/* Counters of a peer, since the link was initialized. */
typedef enum {
    FSM_LINK_FRAMES,      /* received in the peer's present session, including those dropped by faults */
    FSM_LINK_LOST_FRAMES, /* never arrived, or arrived after a later one */
    FSM_LINK_LOST_EVENTS, /* the events among them, and those rejected by a full ring of the peer */
    FSM_LINK_MISSED,      /* events before the first received frame, of a peer that started earlier */
    FSM_LINK_LATE,        /* of another session, or after a later one; dropped to keep the order */
    FSM_LINK_DOUBLED,     /* repeated; dropped */
    FSM_LINK_OVERFLOW,    /* the ring here was full; dropped */
    FSM_LINK_RESTARTS,    /* sessions after the first */
    FSM_LINK_COUNTS
} fsm_link_counter;

/* Counters of the whole link. */
typedef enum {
    FSM_LINK_SENT,      /* frames passed to the transport */
    FSM_LINK_REFUSED,   /* events rejected by the full ring to the worker; the peers count them */
    FSM_LINK_MALFORMED, /* frames that are invalid, truncated, or have values outside their types */
    FSM_LINK_FOREIGN,   /* frames of another version or map, or of another node than their endpoint's */
    FSM_LINK_BUS_ERRORS, /* error frames of buses that carry frames */
    FSM_LINK_BUS_OFF,   /* error frames that report a bus-off controller */
    FSM_LINK_TOTALS
} fsm_link_total;

typedef struct fsm_link fsm_link;

uint32_t fsm_link_count(const fsm_link *link, uint8_t peer, fsm_link_counter what);
uint32_t fsm_link_counted(const fsm_link *link, fsm_link_total what);

/* Return the present session of a peer; 0 before its first frame. */
uint32_t fsm_link_session(const fsm_link *link, uint8_t peer);

/* Return the cycles (calls of fsm_link_begin, which X_cycle makes) since the last frame of a peer, or
 * since the initialization before its first frame. A peer publishes every cycle, or as often as the
 * deployment specifies, so silence means that it, or the link, is dead. */
uint32_t fsm_link_silence(const fsm_link *link, uint8_t peer);

/* ---- a loop that hangs --------------------------------------------------------------------------
 * Frames leave when the loop completes a cycle. Messages that a carrier sends without the
 * loop (cyclic CAN messages, hellos, diagnostics) depend on this watch, so that a hung loop is silent. */

/* Start to watch the loop of a link, with the bound of the deployment. */
void fsm_link_watch(const fsm_link *link, fsm_watch *watch, uint64_t now_ms);

/* Return whether the loop may be represented as alive: it has completed a cycle within the bound. A
 * carrier calls this at least every fsm_watch_every(watch) ms, from the thread that sends. False
 * before the first cycle. */
bool fsm_link_is_live(const fsm_link *link, fsm_watch *watch, uint64_t now_ms);

/* Return the number of completed cycles, modulo 2^32. */
uint32_t fsm_link_completed(const fsm_link *link);

/* ---- creating a link ---------------------------------------------------------------------------- */

/* Initialize a link without transport. `session` identifies this run of the node. It must be greater
 * than that of the last run (modulo 2^32), for instance the time in milliseconds, or a stored counter
 * of starts; without keys by at most FSM_LINK_SESSIONS. Peers drop frames of any other session as late
 * until the present one is silent for FSM_LINK_QUIET of their cycles. 0 is not a session. */
void fsm_link_init(fsm_link *link, const fsm_link_map *map, uint32_t session);

/* Publish levels in every n-th cycle, overriding the deployment. Before the first cycle. */
void fsm_link_publish_every(fsm_link *link, uint32_t cycles);

/* ---- deterministic co-simulation --------------------------------------------------------------
 * Before each step, the orchestrator gives each node the number of frames that every other node has
 * sent: its fsm_link_counted(.., FSM_LINK_SENT) after its last step. A deterministic transport sends
 * and receives within the calls of the loop only, so that a step sees the same messages in every run.
 * Frames dropped by seeded faults count as received. */

typedef enum {
    FSM_LINK_READY,
    FSM_LINK_TIMEOUT, /* fsm_link_explain names the missing peer */
    FSM_LINK_BEYOND,  /* more frames arrived than announced: wrong number, or a shared link */
    FSM_LINK_DEAF     /* the transport is not deterministic */
} fsm_link_waited;

/* Block until `frames` frames of the peer's session have arrived. Session 0 is any: if more frames have
 * arrived, they may be of an old session, and a new one is awaited. The timeout counts from the peer's
 * last frame. */
fsm_link_waited fsm_link_await(fsm_link *link, uint8_t peer, uint32_t session, uint32_t frames,
                               uint32_t timeout_ms);

/* Block until a peer listens to this node in this session (0: any), or until all other nodes do, before
 * the first step. Also for threaded transports. A peer listens when it has proved its identity at its
 * endpoint, and with keys, that it has the key. */
fsm_link_waited fsm_link_connect_to(fsm_link *link, uint8_t peer, uint32_t session,
                                    uint32_t timeout_ms);
fsm_link_waited fsm_link_connect(fsm_link *link, uint32_t timeout_ms);

/* Write one line about the last of these waits, truncated to `room` bytes with the zero. */
void fsm_link_explain(const fsm_link *link, char *text, size_t room);

/* ---- seeded faults, for tests ------------------------------------------------------------------
 * Faults between arrival and receipt. Probabilities are in 1/65536; the same seed does the same to the
 * same frames. */

#ifndef FSM_LINK_HELD
#define FSM_LINK_HELD 64 /* maximum number of delayed frames; one more releases the oldest */
#endif

typedef struct {
    /* Set these before the first frame; the rest is zero. */
    uint64_t seed;
    uint32_t loss;
    uint32_t duplication;
    uint32_t delay;        /* the probability; later frames of the same peer wait behind a delayed one */
    uint32_t delay_cycles; /* the delay in cycles of the receiver */
    /* Counted by the receiving thread. */
    uint32_t lost;
    uint32_t duplicated;
    uint32_t delayed;
    /* Internal. */
    fsm_shared is_cut;
    bool is_seeded;
    uint64_t state[FSM_LINK_NODES];
    uint32_t due[FSM_LINK_HELD];
    fsm_link_frame held[FSM_LINK_HELD];
    uint32_t count;
} fsm_link_faults;

/* Lose all frames from now on, as a dead link does, or stop doing so. */
void fsm_link_cut(fsm_link_faults *faults, bool is_cut);

/* Apply faults to arriving frames; NULL: none. Before the transport is opened. */
void fsm_link_set_faults(fsm_link *link, fsm_link_faults *faults);

/* ---- for generated code, in the loop: no call blocks ----------------------------------- */

/* Start a cycle: make the received events and levels visible. */
void fsm_link_begin(fsm_link *link);

/* Return the oldest event received before this cycle, or NULL; then remove it. */
const fsm_link_frame *fsm_link_front(fsm_link *link);
uint16_t fsm_link_message_of(const fsm_link_frame *frame);
void fsm_link_release(fsm_link *link);

/* Return the payload of a peer's levels if new ones arrived since the last call, else NULL. */
const uint8_t *fsm_link_levels(fsm_link *link, uint8_t peer);

/* Reserve room for an event; write its payload to the returned address; put it. NULL: the ring is full,
 * and the event is lost and counted. */
uint8_t *fsm_link_claim(fsm_link *link, uint16_t message);
void fsm_link_put(fsm_link *link);

/* Return the address for the payload of the levels; NULL if this cycle does not publish them. */
uint8_t *fsm_link_levels_out(fsm_link *link);

/* End a cycle: send the events of the cycle and the levels. */
void fsm_link_end(fsm_link *link);

/* ---- for transports ------------------------------------------------------------------- */

typedef struct {
    /* Frames wait in the ring. In a threaded transport: wake it. Never blocks there. */
    void (*wake)(void *carrier, fsm_link *link);
    /* Deterministic transports, else NULL: block until one frame of the peer has gone through
     * fsm_link_arrive; false when the time is over. */
    bool (*receive)(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms);
    /* Block until the peer listens, in this session if it is not 0; false when the time is over. */
    bool (*heard_by)(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms);
    bool is_proven; /* the sender is authenticated, by a key or within one program */
} fsm_link_transport;

void fsm_link_attach(fsm_link *link, const fsm_link_transport *transport, void *carrier);

/* An addition to the transport (fsm_link_fan.h) that receives each outgoing frame in the thread of
 * fsm_link_next, and serializes the threads that call fsm_link_arrive. */
typedef struct {
    void (*take)(void *fan, const fsm_link_frame *frame);
    void (*enter)(void *fan);
    void (*leave)(void *fan);
} fsm_link_beside;

void fsm_link_set_beside(fsm_link *link, const fsm_link_beside *beside, void *fan);

/* Store the next complete frame to send; return false without one. One thread only. */
bool fsm_link_next(fsm_link *link, fsm_link_frame *frame);

/* Receive bytes from the endpoint of a peer. Return whether they were a frame of its present session,
 * even if faults drop it. One thread only, unless there is a fan; it may differ from that of
 * fsm_link_next. */
bool fsm_link_arrive(fsm_link *link, uint8_t peer, const uint8_t *bytes, size_t length);

/* Return the number of arriving events that fit. Other threads that call fsm_link_arrive, and delayed
 * frames, may use the room first. */
uint32_t fsm_link_room(const fsm_link *link);

/* The header of a frame. */
typedef struct {
    uint8_t sender;
    uint32_t hash, session, sequence, events;
    uint16_t message;
} fsm_link_head;

/* The same for a frame that a carrier builds from other bytes; false also if it is too long. */
bool fsm_link_arrive_as(fsm_link *link, const fsm_link_head *head, const uint8_t *payload,
                        size_t size);

/* Count an error frame of a bus. */
void fsm_link_bus_error(fsm_link *link, bool is_bus_off);

/* Release delayed frames whose delay has passed; call it repeatedly in the thread of fsm_link_arrive. */
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

/* The bits of IEEE 754 numbers. */
void fsm_link_put_float(uint8_t *to, float value);
float fsm_link_get_float(const uint8_t *from);
void fsm_link_put_double(uint8_t *to, double value);
double fsm_link_get_double(const uint8_t *from);

/* ---- internals: not for hosts ------------------------------------------------ */

typedef struct {
    fsm_ring ring;
    fsm_link_frame slots[FSM_LINK_SLOTS];
} fsm_link_ring;

/* The latest value of a writer in three buffers: one for each side, and one between them. */
typedef struct {
    fsm_shared middle; /* the place between, with FSM_LINK_NEW if it was written since */
    uint8_t writes;    /* the writer's place */
    uint8_t reads;     /* the reader's place */
    fsm_link_frame places[3];
} fsm_link_latest;

typedef struct {
    fsm_shared counts[FSM_LINK_COUNTS];
    fsm_shared session;  /* of arriving frames; 0 before the first */
    fsm_shared heard;    /* intact frames of all sessions */
    fsm_shared taken;    /* the session of the last received frame */
    uint32_t spoke;      /* the cycle of the last frame of the present session */
    uint32_t sequence;   /* of the next frame */
    uint32_t events;     /* of the next event */
    uint64_t window;     /* bit k: frame `sequence - 1 - k` was received */
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
    uint32_t put;       /* events put or rejected; the next three belong to the loop */
    uint32_t put_before; /* when the last cycle ended */
    uint32_t pending;   /* put in this cycle; visible at its end */
    bool has_levels;
    uint32_t arrived;   /* events of this cycle that remain in `in` */
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
