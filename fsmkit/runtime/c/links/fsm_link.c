/* fsm_link.c: frames, their order, and what is counted. See fsm_link.h. */
#include "fsm_link.h"

#include <string.h>

typedef char fsm_link_needs_counters_of_32_bits[sizeof(FSM_INDEX) >= 4u ? 1 : -1];
typedef char fsm_link_slots_are_a_power_of_two
    [FSM_LINK_SLOTS > 0 && (FSM_LINK_SLOTS & (FSM_LINK_SLOTS - 1)) == 0 ? 1 : -1];
typedef char fsm_link_frames_have_a_size[FSM_LINK_BYTES >= FSM_LINK_HEADER ? 1 : -1];

/* The offsets of the header's fields. */
enum { VERSION = 2, SENDER = 3, HASH = 4, SESSION = 8, SEQUENCE = 12, EVENTS = 16, MESSAGE = 20 };

#define MAGIC_0 0x46u /* F */
#define MAGIC_1 0x4Bu /* K */

/* Write one, return the other, as one: with what was written before, and what is read after. */
#if defined(FSM_LINK_EXCHANGE)
#define EXCHANGE(at, value) FSM_LINK_EXCHANGE(at, value)
#elif defined(FSM_BARRIER)
#error "define FSM_LINK_EXCHANGE(address, value) beside FSM_BARRIER()"
#elif !defined(__cplusplus) && defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L &&         \
    !defined(__STDC_NO_ATOMICS__)
#define EXCHANGE(at, value) atomic_exchange_explicit(at, value, memory_order_acq_rel)
#else
#define EXCHANGE(at, value) __atomic_exchange_n(at, value, __ATOMIC_ACQ_REL)
#endif

static void add(fsm_shared *counter, uint32_t more)
{
    fsm_shared_write(counter, (FSM_INDEX)(fsm_shared_own(counter) + more));
}

static uint32_t get32(const uint8_t *from)
{
    return (uint32_t)fsm_link_get_bytes(from, 4u);
}

/* Whether number `a` is `b` or later, modulo 2^32. */
static bool reached(uint32_t a, uint32_t b)
{
    return a - b < 0x80000000u;
}

/* ---- the latest value of a writer -------------------------------------------------------------- */

#define IS_NEW 4u

static void latest_init(fsm_link_latest *latest)
{
    latest->writes = 0u;
    latest->reads = 1u;
    fsm_shared_write(&latest->middle, 2u);
}

static void latest_publish(fsm_link_latest *latest)
{
    FSM_INDEX before = EXCHANGE(&latest->middle, (FSM_INDEX)(latest->writes | IS_NEW));
    latest->writes = (uint8_t)(before & 3u);
}

/* Return the last published levels; NULL if they were read before. */
static const fsm_link_frame *latest_read(fsm_link_latest *latest)
{
    if ((fsm_shared_read(&latest->middle) & IS_NEW) == 0u) {
        return NULL;
    }
    latest->reads = (uint8_t)(EXCHANGE(&latest->middle, (FSM_INDEX)latest->reads) & 3u);
    return &latest->places[latest->reads];
}

/* ---- making a link ---------------------------------------------------------------------------- */

void fsm_link_init(fsm_link *link, const fsm_link_map *map, uint32_t session)
{
    memset(link, 0, sizeof *link);
    link->map = map;
    link->session = session;
    link->every = map->every > 0u ? map->every : 1u;
    latest_init(&link->levels);
    for (unsigned peer = 0u; peer < FSM_LINK_NODES; peer++) {
        latest_init(&link->peers[peer].levels);
    }
}

void fsm_link_publish_every(fsm_link *link, uint32_t cycles)
{
    link->every = cycles > 0u ? cycles : 1u;
}

void fsm_link_set_faults(fsm_link *link, fsm_link_faults *faults)
{
    link->faults = faults;
}

void fsm_link_attach(fsm_link *link, const fsm_link_transport *transport, void *carrier)
{
    link->transport = transport;
    link->carrier = carrier;
}

void fsm_link_set_beside(fsm_link *link, const fsm_link_beside *beside, void *fan)
{
    link->beside = beside;
    link->fan = fan;
}

/* ---- what is counted -------------------------------------------------------------------------- */

uint32_t fsm_link_count(const fsm_link *link, uint8_t peer, fsm_link_counter what)
{
    return peer < FSM_LINK_NODES && what < FSM_LINK_COUNTS
               ? (uint32_t)fsm_shared_read(&link->peers[peer].counts[what])
               : 0u;
}

uint32_t fsm_link_counted(const fsm_link *link, fsm_link_total what)
{
    return what < FSM_LINK_TOTALS ? (uint32_t)fsm_shared_read(&link->totals[what]) : 0u;
}

uint32_t fsm_link_session(const fsm_link *link, uint8_t peer)
{
    return peer < FSM_LINK_NODES ? (uint32_t)fsm_shared_read(&link->peers[peer].session) : 0u;
}

uint32_t fsm_link_silence(const fsm_link *link, uint8_t peer)
{
    uint32_t cycle = (uint32_t)fsm_shared_own(&link->cycle);
    return peer < FSM_LINK_NODES ? cycle - link->peers[peer].seen_cycle : cycle;
}

/* ---- a loop that hangs ------------------------------------------------------------------------ */

void fsm_link_watch(const fsm_link *link, fsm_watch *watch, uint64_t now_ms)
{
    uint32_t bound = link->map->watchdog_ms;
    fsm_watch_start(watch, fsm_shared_read(&link->completed),
                    bound > 0u ? bound : FSM_LINK_WATCHDOG_MS, now_ms);
}

bool fsm_link_is_live(const fsm_link *link, fsm_watch *watch, uint64_t now_ms)
{
    FSM_INDEX completed = fsm_shared_read(&link->completed);
    return fsm_watch_look(watch, completed, now_ms) && completed != 0u;
}

uint32_t fsm_link_completed(const fsm_link *link)
{
    return (uint32_t)fsm_shared_read(&link->completed);
}

/* ---- the loop's end --------------------------------------------------------------------------- */

void fsm_link_begin(fsm_link *link)
{
    uint32_t cycle = (uint32_t)fsm_shared_own(&link->cycle) + 1u;
    fsm_shared_write(&link->cycle, (FSM_INDEX)cycle);
    if (link->transport == NULL || link->transport->receive != NULL) {
        fsm_link_pass_time(link); /* no other thread does */
    }
    for (unsigned peer = 0u; peer < link->map->nodes && peer < FSM_LINK_NODES; peer++) {
        fsm_link_peer *p = &link->peers[peer];
        uint32_t heard = (uint32_t)fsm_shared_read(&p->heard);
        if (heard != p->seen) {
            p->seen = heard;
            p->seen_cycle = cycle;
        }
    }
    /* Levels are looked at after this, so that they are no older than these events. */
    link->arrived = (uint32_t)fsm_ring_count(&link->in.ring);
}

const fsm_link_frame *fsm_link_front(fsm_link *link)
{
    FSM_INDEX place;
    if (link->arrived == 0u || !fsm_ring_front(&link->in.ring, FSM_LINK_SLOTS, &place)) {
        return NULL;
    }
    return &link->in.slots[place];
}

uint16_t fsm_link_message_of(const fsm_link_frame *frame)
{
    return (uint16_t)fsm_link_get_bytes(frame->bytes + MESSAGE, 2u);
}

void fsm_link_release(fsm_link *link)
{
    link->arrived--;
    fsm_ring_release(&link->in.ring);
}

const uint8_t *fsm_link_levels(fsm_link *link, uint8_t peer)
{
    const fsm_link_frame *frame;
    if (peer >= FSM_LINK_NODES) {
        return NULL;
    }
    frame = latest_read(&link->peers[peer].levels);
    return frame == NULL ? NULL : frame->bytes + FSM_LINK_HEADER;
}

uint8_t *fsm_link_claim(fsm_link *link, uint16_t message)
{
    FSM_INDEX put = (FSM_INDEX)(fsm_shared_own(&link->out.ring.put) + link->pending);
    uint32_t length = FSM_LINK_HEADER + (uint32_t)link->map->message[message - 1u].size;
    fsm_link_frame *frame;
    if ((FSM_INDEX)(put - fsm_shared_read(&link->out.ring.got)) >= FSM_LINK_SLOTS ||
        length > FSM_LINK_BYTES) {
        link->put++;
        add(&link->totals[FSM_LINK_REFUSED], 1u);
        return NULL;
    }
    frame = &link->out.slots[put % FSM_LINK_SLOTS];
    frame->number = link->put;
    frame->length = (uint16_t)length;
    fsm_link_put_bytes(frame->bytes + MESSAGE, message, 2u);
    return frame->bytes + FSM_LINK_HEADER;
}

void fsm_link_put(fsm_link *link)
{
    link->put++;
    link->pending++;
}

uint8_t *fsm_link_levels_out(fsm_link *link)
{
    fsm_link_frame *frame = &link->levels.places[link->levels.writes];
    uint32_t length = FSM_LINK_HEADER + (uint32_t)link->map->levels[link->map->node];
    uint32_t cycle = (uint32_t)fsm_shared_own(&link->cycle);
    if ((cycle - 1u) % link->every != 0u || length > FSM_LINK_BYTES) {
        return NULL;
    }
    frame->length = (uint16_t)length;
    frame->number = link->put_before;
    fsm_link_put_bytes(frame->bytes + MESSAGE, FSM_LINK_LEVELS, 2u);
    link->has_levels = true;
    return frame->bytes + FSM_LINK_HEADER;
}

/* The levels first: whoever sees an event sees the levels of its cycle, or later ones. */
void fsm_link_end(fsm_link *link)
{
    bool has_work = link->has_levels || link->pending > 0u;
    FSM_INDEX completed = (FSM_INDEX)(fsm_shared_own(&link->completed) + 1u);
    fsm_shared_write(&link->completed, completed != 0u ? completed : 1u); /* 0: before the first */
    if (link->has_levels) {
        latest_publish(&link->levels);
    }
    fsm_shared_write(&link->out.ring.put,
                     (FSM_INDEX)(fsm_shared_own(&link->out.ring.put) + link->pending));
    link->pending = 0u;
    link->has_levels = false;
    link->put_before = link->put;
    if (has_work && link->transport != NULL) {
        link->transport->wake(link->carrier, link);
    }
}

/* ---- the sender's end ------------------------------------------------------------------------- */

bool fsm_link_next(fsm_link *link, fsm_link_frame *frame)
{
    FSM_INDEX place;
    const fsm_link_frame *found;
    bool has_event = fsm_ring_front(&link->out.ring, FSM_LINK_SLOTS, &place);
    found = latest_read(&link->levels);
    if (found != NULL) {
        /* With an empty ring, all events of earlier cycles were sent or rejected. */
        if (fsm_ring_count(&link->out.ring) == 0u && reached(found->number, link->events)) {
            link->events = found->number;
        }
    } else if (has_event) {
        found = &link->out.slots[place];
        link->events = found->number;
    } else {
        return false;
    }
    frame->length = found->length;
    memcpy(frame->bytes + MESSAGE, found->bytes + MESSAGE, (size_t)found->length - MESSAGE);
    frame->bytes[0] = MAGIC_0;
    frame->bytes[1] = MAGIC_1;
    frame->bytes[VERSION] = FSM_LINK_VERSION;
    frame->bytes[SENDER] = link->map->node;
    fsm_link_put_bytes(frame->bytes + HASH, link->map->hash, 4u);
    fsm_link_put_bytes(frame->bytes + SESSION, link->session, 4u);
    fsm_link_put_bytes(frame->bytes + SEQUENCE, link->sequence, 4u);
    fsm_link_put_bytes(frame->bytes + EVENTS, link->events, 4u);
    frame->number = link->events;
    link->sequence++;
    if (fsm_link_get_bytes(frame->bytes + MESSAGE, 2u) != FSM_LINK_LEVELS) {
        link->events++;
        fsm_ring_release(&link->out.ring);
    }
    add(&link->totals[FSM_LINK_SENT], 1u);
    if (link->beside != NULL) {
        link->beside->take(link->fan, frame);
    }
    return true;
}

/* ---- the receiver's end ----------------------------------------------------------------------- */

/* Return whether a frame is the next of its peer, or a later one. Count the frames between, or the
 * kind of an unexpected frame. */
static bool in_order(fsm_link_peer *peer, const uint8_t *bytes)
{
    uint32_t session = get32(bytes + SESSION);
    uint32_t sequence = get32(bytes + SEQUENCE);
    uint32_t events = get32(bytes + EVENTS);
    uint32_t taken = (uint32_t)fsm_shared_own(&peer->taken);
    uint32_t newer;
    if (session != taken) { /* is_present has let it in; faults keep the order */
        if (taken == 0u) {
            add(&peer->counts[FSM_LINK_MISSED], events);
            peer->sequence = sequence;
            peer->events = events;
        } else {
            add(&peer->counts[FSM_LINK_RESTARTS], 1u);
            peer->sequence = 0u;
            peer->events = 0u;
        }
        peer->window = 0u;
        fsm_shared_write(&peer->taken, (FSM_INDEX)session);
    }
    if (!reached(sequence, peer->sequence)) {
        uint32_t age = peer->sequence - 1u - sequence;
        uint64_t bit = age < 64u ? (uint64_t)1 << age : 0u;
        add(&peer->counts[(peer->window & bit) != 0u ? FSM_LINK_DOUBLED : FSM_LINK_LATE], 1u);
        peer->window |= bit;
        return false;
    }
    newer = sequence - peer->sequence;
    if (newer > 0u) {
        add(&peer->counts[FSM_LINK_LOST_FRAMES], newer);
    }
    peer->window = newer < 63u ? (peer->window << (newer + 1u)) | 1u : 1u;
    peer->sequence = sequence + 1u;
    if (events != peer->events && reached(events, peer->events)) {
        add(&peer->counts[FSM_LINK_LOST_EVENTS], events - peer->events);
    }
    peer->events = events;
    return true;
}

static void copy_frame(fsm_link_frame *to, const uint8_t *bytes, size_t length)
{
    to->number = get32(bytes + EVENTS);
    to->length = (uint16_t)length;
    memcpy(to->bytes, bytes, length);
}

/* Take in a frame that is well formed, after all faults. */
static void take_in(fsm_link *link, const uint8_t *bytes, size_t length)
{
    fsm_link_peer *peer = &link->peers[bytes[SENDER]];
    uint32_t message = (uint32_t)fsm_link_get_bytes(bytes + MESSAGE, 2u);
    FSM_INDEX place;
    if (!in_order(peer, bytes)) {
        return;
    }
    add(&peer->heard, 1u);
    if (message == FSM_LINK_LEVELS) {
        copy_frame(&peer->levels.places[peer->levels.writes], bytes, length);
        latest_publish(&peer->levels);
        return;
    }
    peer->events++;
    if (link->map->message[message - 1u].receiver != link->map->node) {
        return;
    }
    if (!fsm_ring_claim(&link->in.ring, FSM_LINK_SLOTS, &place)) {
        add(&peer->counts[FSM_LINK_OVERFLOW], 1u);
        return;
    }
    copy_frame(&link->in.slots[place], bytes, length);
    fsm_ring_publish(&link->in.ring);
}

/* Whether these bytes are a frame of this system that the peer can have sent. */
static bool is_frame(fsm_link *link, uint8_t peer, const uint8_t *bytes, size_t length)
{
    const fsm_link_map *map = link->map;
    uint32_t message, size;
    uint8_t sender;
    if (length < 3u || bytes[0] != MAGIC_0 || bytes[1] != MAGIC_1) {
        add(&link->totals[FSM_LINK_MALFORMED], 1u);
        return false;
    }
    if (bytes[VERSION] != FSM_LINK_VERSION) {
        add(&link->totals[FSM_LINK_FOREIGN], 1u);
        return false;
    }
    if (length < FSM_LINK_HEADER || length > FSM_LINK_BYTES) {
        add(&link->totals[FSM_LINK_MALFORMED], 1u);
        return false;
    }
    sender = bytes[SENDER];
    if (get32(bytes + HASH) != map->hash || sender >= map->nodes || sender >= FSM_LINK_NODES ||
        sender == map->node) {
        add(&link->totals[FSM_LINK_FOREIGN], 1u);
        return false;
    }
    message = (uint32_t)fsm_link_get_bytes(bytes + MESSAGE, 2u);
    size = message == FSM_LINK_LEVELS ? map->levels[sender]
           : message <= map->messages ? map->message[message - 1u].size
                                      : FSM_LINK_BYTES;
    if (length != FSM_LINK_HEADER + size || get32(bytes + SESSION) == 0u ||
        (message != FSM_LINK_LEVELS && map->message[message - 1u].sender != sender) ||
        !map->is_valid(sender, (uint16_t)message, bytes + FSM_LINK_HEADER)) {
        add(&link->totals[FSM_LINK_MALFORMED], 1u);
        return false;
    }
    if (sender != peer) {
        add(&link->totals[FSM_LINK_FOREIGN], 1u);
        return false;
    }
    return true;
}

/* Count a frame, and return whether it belongs to the present session or starts a new one. A later
 * session starts immediately; if the peer has shown no key, only the next FSM_LINK_SESSIONS do. Any
 * other starts after FSM_LINK_QUIET silent cycles of the present one. So a forged session locks the
 * peer out for at most that time. */
static bool is_present(const fsm_link *link, fsm_link_peer *peer, uint32_t session)
{
    uint32_t present = (uint32_t)fsm_shared_own(&peer->session);
    uint32_t cycle = (uint32_t)fsm_shared_read(&link->cycle);
    if (session != present) {
        bool is_proven = link->transport != NULL && link->transport->is_proven;
        bool is_next = session - present < (is_proven ? 0x80000000u : FSM_LINK_SESSIONS);
        if (present != 0u && !is_next && cycle - peer->spoke < FSM_LINK_QUIET) {
            add(&peer->counts[FSM_LINK_LATE], 1u);
            return false;
        }
        fsm_shared_write(&peer->counts[FSM_LINK_FRAMES], 0u);
        fsm_shared_write(&peer->session, (FSM_INDEX)session);
    }
    peer->spoke = cycle;
    add(&peer->counts[FSM_LINK_FRAMES], 1u);
    return true;
}

/* ---- faults ----------------------------------------------------------------------------------- */

void fsm_link_cut(fsm_link_faults *faults, bool is_cut)
{
    fsm_shared_write(&faults->is_cut, is_cut ? 1u : 0u);
}

/* SplitMix64 (Steele, Lea, Flood 2014). */
static uint64_t random64(uint64_t *state)
{
    uint64_t z = (*state += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static void let_go(fsm_link *link, fsm_link_faults *faults, uint32_t place)
{
    take_in(link, faults->held[place].bytes, faults->held[place].length);
    faults->count--;
    for (; place < faults->count; place++) {
        faults->held[place] = faults->held[place + 1u];
        faults->due[place] = faults->due[place + 1u];
    }
}

static bool waits(const fsm_link_faults *faults, uint8_t sender)
{
    for (uint32_t i = 0u; i < faults->count; i++) {
        if (faults->held[i].bytes[SENDER] == sender) {
            return true;
        }
    }
    return false;
}

/* One draw a frame, whatever it does: 16 bits each for loss, duplication, delay. */
static void through(fsm_link *link, fsm_link_faults *faults, const uint8_t *bytes, size_t length)
{
    uint8_t sender = bytes[SENDER];
    uint32_t now = (uint32_t)fsm_shared_read(&link->cycle);
    uint64_t chance;
    bool is_late;
    if (!faults->is_seeded) {
        for (unsigned i = 0u; i < FSM_LINK_NODES; i++) {
            faults->state[i] = faults->seed + i;
            faults->state[i] = random64(&faults->state[i]);
        }
        faults->is_seeded = true;
    }
    chance = random64(&faults->state[sender]);
    if (fsm_shared_read(&faults->is_cut) != 0u || (chance & 0xFFFFu) < faults->loss) {
        faults->lost++;
        return;
    }
    is_late = ((chance >> 32) & 0xFFFFu) < faults->delay && faults->delay_cycles > 0u;
    if (is_late) {
        faults->delayed++;
    }
    for (unsigned copies = ((chance >> 16) & 0xFFFFu) < faults->duplication ? 2u : 1u; copies > 0u;
         copies--) {
        if (copies == 2u) {
            faults->duplicated++;
        }
        if (!is_late && !waits(faults, sender)) {
            take_in(link, bytes, length);
            continue;
        }
        if (faults->count == FSM_LINK_HELD) {
            let_go(link, faults, 0u);
        }
        copy_frame(&faults->held[faults->count], bytes, length);
        faults->due[faults->count] = is_late ? now + faults->delay_cycles : now;
        faults->count++;
    }
}

uint32_t fsm_link_room(const fsm_link *link)
{
    FSM_INDEX put = fsm_shared_read(&link->in.ring.put);
    return FSM_LINK_SLOTS - (uint32_t)(FSM_INDEX)(put - fsm_shared_read(&link->in.ring.got));
}

/* With a fan, the threads that hand over what has come take turns. */
static void enter(fsm_link *link)
{
    if (link->beside != NULL) {
        link->beside->enter(link->fan);
    }
}

static void leave(fsm_link *link)
{
    if (link->beside != NULL) {
        link->beside->leave(link->fan);
    }
}

void fsm_link_pass_time(fsm_link *link)
{
    fsm_link_faults *faults = link->faults;
    uint32_t now = (uint32_t)fsm_shared_read(&link->cycle);
    bool waiting[FSM_LINK_NODES] = {false};
    uint32_t place = 0u;
    if (faults == NULL) {
        return;
    }
    enter(link);
    while (place < faults->count) {
        uint8_t sender = faults->held[place].bytes[SENDER];
        if (!waiting[sender] && reached(now, faults->due[place])) {
            let_go(link, faults, place);
        } else {
            waiting[sender] = true; /* and all behind it */
            place++;
        }
    }
    leave(link);
}

static bool arrive(fsm_link *link, uint8_t peer, const uint8_t *bytes, size_t length)
{
    if (!is_frame(link, peer, bytes, length) ||
        !is_present(link, &link->peers[peer], get32(bytes + SESSION)))
        return false;
    if (link->faults != NULL) {
        through(link, link->faults, bytes, length);
    } else {
        take_in(link, bytes, length);
    }
    return true;
}

bool fsm_link_arrive(fsm_link *link, uint8_t peer, const uint8_t *bytes, size_t length)
{
    bool is_present;
    enter(link);
    is_present = arrive(link, peer, bytes, length);
    leave(link);
    return is_present;
}

bool fsm_link_arrive_as(fsm_link *link, const fsm_link_head *head, const uint8_t *payload,
                        size_t size)
{
    uint8_t bytes[FSM_LINK_BYTES];
    if (size > FSM_LINK_BYTES - FSM_LINK_HEADER) {
        return false;
    }
    bytes[0] = MAGIC_0;
    bytes[1] = MAGIC_1;
    bytes[VERSION] = FSM_LINK_VERSION;
    bytes[SENDER] = head->sender;
    fsm_link_put_bytes(bytes + HASH, head->hash, 4u);
    fsm_link_put_bytes(bytes + SESSION, head->session, 4u);
    fsm_link_put_bytes(bytes + SEQUENCE, head->sequence, 4u);
    fsm_link_put_bytes(bytes + EVENTS, head->events, 4u);
    fsm_link_put_bytes(bytes + MESSAGE, head->message, 2u);
    if (size > 0u) {
        memcpy(bytes + FSM_LINK_HEADER, payload, size);
    }
    return fsm_link_arrive(link, head->sender, bytes, FSM_LINK_HEADER + size);
}

void fsm_link_bus_error(fsm_link *link, bool is_bus_off)
{
    enter(link);
    add(&link->totals[FSM_LINK_BUS_ERRORS], 1u);
    add(&link->totals[FSM_LINK_BUS_OFF], is_bus_off ? 1u : 0u);
    leave(link);
}

/* ---- deterministic co-simulation -------------------------------------------------------------- */

fsm_link_waited fsm_link_await(fsm_link *link, uint8_t peer, uint32_t session, uint32_t frames,
                               uint32_t timeout_ms)
{
    link->waited_peer = peer;
    link->waited_session = session;
    link->waited_frames = frames;
    link->waited_for_listener = false;
    if (link->transport == NULL || link->transport->receive == NULL || peer >= FSM_LINK_NODES) {
        return FSM_LINK_DEAF;
    }
    for (;;) {
        uint32_t present = fsm_link_session(link, peer);
        uint32_t come = fsm_link_count(link, peer, FSM_LINK_FRAMES);
        if (session == 0u || present == session) {
            if (come == frames) {
                return FSM_LINK_READY;
            }
            if (come > frames && session != 0u) {
                return FSM_LINK_BEYOND;
            }
        } else if (present == 0u ? frames == 0u : reached(session, present) && frames == 0u) {
            return FSM_LINK_READY; /* nothing of that session is to come yet */
        } else if (present != 0u && !reached(session, present)) {
            return FSM_LINK_BEYOND;
        }
        if (!link->transport->receive(link->carrier, link, peer, timeout_ms)) {
            return session == 0u && come > frames ? FSM_LINK_BEYOND : FSM_LINK_TIMEOUT;
        }
    }
}

fsm_link_waited fsm_link_connect_to(fsm_link *link, uint8_t peer, uint32_t session,
                                    uint32_t timeout_ms)
{
    link->waited_peer = peer;
    link->waited_session = session;
    link->waited_for_listener = true;
    if (link->transport == NULL || link->transport->heard_by == NULL || peer >= FSM_LINK_NODES) {
        return FSM_LINK_DEAF;
    }
    return link->transport->heard_by(link->carrier, link, peer, session, timeout_ms)
               ? FSM_LINK_READY
               : FSM_LINK_TIMEOUT;
}

fsm_link_waited fsm_link_connect(fsm_link *link, uint32_t timeout_ms)
{
    for (uint8_t peer = 0u; peer < link->map->nodes; peer++) {
        fsm_link_waited found = FSM_LINK_READY;
        if (peer != link->map->node) {
            found = fsm_link_connect_to(link, peer, 0u, timeout_ms);
        }
        if (found != FSM_LINK_READY) {
            return found;
        }
    }
    return FSM_LINK_READY;
}

/* ---- text ------------------------------------------------------------------------------------- */

typedef struct {
    char *text;
    size_t room, used;
} writer;

static void write_text(writer *out, const char *text)
{
    for (; *text != '\0' && out->used + 1u < out->room; text++) {
        out->text[out->used++] = *text;
    }
}

static void write_number(writer *out, uint32_t number)
{
    char digits[11];
    size_t place = sizeof digits - 1u;
    digits[place] = '\0';
    do {
        digits[--place] = (char)('0' + number % 10u);
        number /= 10u;
    } while (number > 0u);
    write_text(out, digits + place);
}

void fsm_link_explain(const fsm_link *link, char *text, size_t room)
{
    writer out = {text, room, 0u};
    const fsm_link_map *map = link->map;
    if (room == 0u) {
        return;
    }
    write_text(&out, "node `");
    write_text(&out, map->names[map->node]);
    write_text(&out, "` waited for `");
    write_text(&out, link->waited_peer < map->nodes ? map->names[link->waited_peer] : "?");
    if (link->waited_for_listener) {
        write_text(&out, "` to listen");
    } else {
        write_text(&out, "`: ");
        write_number(&out, link->waited_frames);
        write_text(&out, " frames of session ");
        write_number(&out, link->waited_session);
        write_text(&out, ", there are ");
        write_number(&out, fsm_link_count(link, link->waited_peer, FSM_LINK_FRAMES));
        write_text(&out, " of session ");
        write_number(&out, fsm_link_session(link, link->waited_peer));
    }
    text[out.used] = '\0';
}

void fsm_link_put_double(uint8_t *to, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    fsm_link_put_bytes(to, bits, 8u);
}

void fsm_link_put_float(uint8_t *to, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    fsm_link_put_bytes(to, bits, 4u);
}

float fsm_link_get_float(const uint8_t *from)
{
    uint32_t bits = get32(from);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

double fsm_link_get_double(const uint8_t *from)
{
    uint64_t bits = fsm_link_get_bytes(from, 8u);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}
