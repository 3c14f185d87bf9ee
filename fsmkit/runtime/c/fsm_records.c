/* fsm_records.c: the ring of records, and the head of each record; see fsm_records.h. */
#include "fsm_records.h"

#if FSM_TRACE_LEVEL > 0

#ifdef FSM_TRACE_STATE
fsm_records_state *FSM_TRACE_STATE;
#else
fsm_records_state fsm_records;
#endif

/* ---- the ring ---------------------------------------------------------------------------------- */

#ifdef FSM_RECORDS_RING

enum {
    MASK = FSM_TRACE_SIZE - 1,
    MOST = 15 /* bytes of a record without a payload: losses 4, instance 4, time 6, number 1 */
};

typedef char fsm_trace_size_is_a_power_of_two[(FSM_TRACE_SIZE & MASK) == 0 ? 1 : -1];
typedef char fsm_trace_size_is_at_least_64[FSM_TRACE_SIZE >= 64 ? 1 : -1];

static volatile uint8_t ring_[FSM_TRACE_SIZE];

/* Probes look for one block: that of a second context has an id that they pass over. */
fsm_records_block fsm_records_rtt = {
#ifdef FSM_TRACE_CONTEXT
    {'F', 'S', 'M', 'K', 'I', 'T', ' ', 'R', 'T', 'T', '\0', '\0', '\0', '\0', '\0', '\0'},
#else
    {'S', 'E', 'G', 'G', 'E', 'R', ' ', 'R', 'T', 'T', '\0', '\0', '\0', '\0', '\0', '\0'},
#endif
    1,
    0,
    {"fsm", ring_, FSM_TRACE_SIZE, 0u, 0u, 0u},
};

/* Whoever reads sees bytes before he sees that they are there: all of them are volatile. */
static inline bool fsm_records_put(const uint8_t *bytes, unsigned n)
{
    uint32_t write = fsm_records_rtt.up.write;
    if (((fsm_records_rtt.up.read - write - 1u) & MASK) < n) {
        return false;
    }
    do {
        ring_[write] = *bytes++;
        write = (write + 1u) & MASK;
    } while (--n > 0u);
    fsm_records_rtt.up.write = write;
    return true;
}

size_t fsm_records_take(uint8_t *bytes, size_t room)
{
    const uint32_t write = fsm_records_rtt.up.write;
    uint32_t read = fsm_records_rtt.up.read;
    size_t count = 0u;
    while (read != write && count < room) {
        bytes[count++] = ring_[read];
        read = (read + 1u) & MASK;
    }
    fsm_records_rtt.up.read = read;
    return count;
}

/* CRC-16/CCITT-FALSE (ITU-T V.41), bit by bit: no table. */
static uint16_t crc16(const uint8_t *bytes, size_t size)
{
    uint32_t crc = 0xFFFFu;
    for (size_t i = 0u; i < size; i++) {
        crc ^= (uint32_t)bytes[i] << 8;
        for (unsigned bit = 0u; bit < 8u; bit++) {
            crc = (crc & 0x8000u) != 0u ? crc << 1 ^ 0x1021u : crc << 1;
        }
    }
    return (uint16_t)(crc & 0xFFFFu);
}

size_t fsm_records_frame(uint8_t *frame)
{
    static uint8_t sequence;
    static bool is_within; /* the last frame was full: this one may start within a record */
    size_t code = 0u;      /* where the next code of COBS goes */
    size_t size = fsm_records_take(&frame[2], FSM_FRAME_MOST);
    uint16_t crc;
    if (size == 0u) {
        return 0u;
    }
    frame[1] = (uint8_t)(sequence | (is_within ? 0x80u : 0u));
    sequence = (uint8_t)((sequence + 1u) & 0x7Fu);
    is_within = size == FSM_FRAME_MOST;
    crc = crc16(&frame[1], 1u + size);
    frame[2u + size] = (uint8_t)(crc >> 8);
    frame[3u + size] = (uint8_t)(crc & 0xFFu);
    size += 4u; /* fewer than 254 bytes: a code at the start, and one for each zero */
    for (size_t i = 1u; i < size; i++) {
        if (frame[i] == 0u) {
            frame[code] = (uint8_t)(i - code);
            code = i;
        }
    }
    frame[code] = (uint8_t)(size - code);
    frame[size] = 0u;
    return size + 1u;
}

#endif

/* ---- records ----------------------------------------------------------------------------------- */

uint8_t *fsm_records_varint(uint8_t *at, uint32_t value)
{
    while (value > 0x7Fu) {
        *at++ = (uint8_t)((value & 0x7Fu) | 0x80u);
        value >>= 7;
    }
    *at++ = (uint8_t)value;
    return at;
}

uint8_t *fsm_records_numbered(uint8_t *at, uint32_t number)
{
    if (number >= (uint32_t)FSM_RECORDS_DIRECT) {
        *at++ = (uint8_t)FSM_RECORD_FAR;
        return fsm_records_varint(at, number - (uint32_t)FSM_RECORDS_DIRECT);
    }
    *at++ = (uint8_t)number;
    return at;
}

static uint8_t *put_losses(uint8_t *at)
{
    if (fsm_records.lost > 0u) {
        *at++ = (uint8_t)FSM_RECORD_LOST;
        at = fsm_records_varint(at, fsm_records.lost);
    }
    return at;
}

uint8_t *fsm_records_head(uint8_t *at, uint32_t now, uint16_t instance)
{
    const uint32_t passed = now - fsm_records.told;
    at = put_losses(at);
#ifdef FSM_INSTANCE
    if (instance != fsm_records.instance) {
        *at++ = (uint8_t)FSM_RECORD_INSTANCE;
        at = fsm_records_varint(at, instance);
    }
#else
    (void)instance;
#endif
    if (passed >= 0x80u) {
        *at++ = (uint8_t)FSM_RECORD_TIME;
        at = fsm_records_varint(at, passed);
    } else if (passed > 0u) {
        *at++ = (uint8_t)((uint32_t)FSM_RECORD_SHORT_TIME + passed);
    }
    return at;
}

static inline void sync_soon(uint32_t now)
{
    fsm_records.synced = now - 0x7FFFFFFFu;
#ifdef FSM_INSTANCE
    fsm_records.first = NULL;
#endif
}

/* Time and instance count as recorded only with a stored record; complete states follow a loss. */
static bool put_all(const uint8_t *bytes, const uint8_t *end, uint32_t now, uint16_t instance)
{
    if (!FSM_TRACE_PUT(bytes, (unsigned)(end - bytes))) {
        return false;
    }
    if (fsm_records.lost > 0u) {
        fsm_records.lost = 0u;
        sync_soon(now);
    }
    fsm_records.told = now;
#ifdef FSM_INSTANCE
    fsm_records.instance = instance;
#else
    (void)instance;
#endif
    return true;
}

void fsm_records_commit(const uint8_t *bytes, const uint8_t *end, uint32_t now, uint16_t instance)
{
    if (!put_all(bytes, end, now, instance)) {
        fsm_count(&fsm_records.lost);
    }
}

void fsm_records_offer(const uint8_t *bytes, const uint8_t *end, uint32_t now, uint16_t instance)
{
    (void)put_all(bytes, end, now, instance);
}

#ifdef FSM_RECORDS_RING

/* Called more often than it is worth to be copied there. */
#ifdef __GNUC__
#define SHARED __attribute__((noinline)) static
#else
#define SHARED static
#endif

/* Put a byte at a position of the ring, which must have room; return the next position. */
SHARED uint32_t put(uint32_t at, uint32_t byte)
{
    ring_[at] = (uint8_t)byte;
    return (at + 1u) & MASK;
}

SHARED uint32_t put_number(uint32_t at, uint32_t value)
{
    while (value > 0x7Fu) {
        at = put(at, value | 0x80u);
        value >>= 7;
    }
    return put(at, value);
}

/* Whole states follow. */
SHARED uint32_t put_lost(uint32_t at, uint32_t now)
{
    at = put_number(put(at, (uint32_t)FSM_RECORD_LOST), fsm_records.lost);
    fsm_records.lost = 0u;
    sync_soon(now);
    return at;
}

/* Put the rare heads of a record: losses, another instance, a long time. Then put the record. */
SHARED void put_seldom(uint32_t now, uint32_t first, uint16_t instance)
{
    const uint32_t passed = now - fsm_records.told;
    uint32_t at = fsm_records_rtt.up.write;
    if (((fsm_records_rtt.up.read - at - 1u) & MASK) < MOST) {
        fsm_count(&fsm_records.lost);
        return;
    }
    if (fsm_records.lost > 0u) {
        at = put_lost(at, now);
    }
#ifdef FSM_INSTANCE
    if (instance != fsm_records.instance) {
        at = put_number(put(at, (uint32_t)FSM_RECORD_INSTANCE), instance);
        fsm_records.instance = instance;
    }
#endif
    if (passed > 0x7Fu) {
        at = put_number(put(at, (uint32_t)FSM_RECORD_TIME), passed);
        fsm_records.told = now;
    }
    fsm_records_rtt.up.write = at;
    fsm_records_byte(now, first, instance);
}

/* It calls nothing else, and so saves no register. */
void fsm_records_byte(uint32_t now, uint32_t first, uint16_t instance)
{
    const uint32_t passed = now - fsm_records.told;
    uint32_t at = fsm_records_rtt.up.write;
    bool is_seldom = passed > 0x7Fu || fsm_records.lost > 0u
                     || ((fsm_records_rtt.up.read - at - 1u) & MASK) < 2u;
#ifdef FSM_INSTANCE
    is_seldom = is_seldom || instance != fsm_records.instance;
#endif
    if (is_seldom) {
        put_seldom(now, first, instance);
        return;
    }
    if (passed > 0u) {
        ring_[at] = (uint8_t)((uint32_t)FSM_RECORD_SHORT_TIME + passed);
        at = (at + 1u) & MASK;
    }
    ring_[at] = (uint8_t)first;
    fsm_records_rtt.up.write = (at + 1u) & MASK;
    fsm_records.told = now;
}

#else

void fsm_records_byte(uint32_t now, uint32_t first, uint16_t instance)
{
    fsm_records_any(now, first, instance);
}

#endif

void fsm_records_any(uint32_t now, uint32_t first, uint16_t instance)
{
    uint8_t bytes[FSM_RECORDS_HEAD];
    uint8_t *at = fsm_records_head(bytes, now, instance);
    if (first < (uint32_t)FSM_RECORDS_FAR) {
        *at++ = (uint8_t)first;
    } else {
        *at++ = (uint8_t)FSM_RECORD_FAR;
        at = fsm_records_varint(at, first - (uint32_t)FSM_RECORDS_FAR);
    }
    fsm_records_commit(bytes, at, now, instance);
}

void fsm_records_note(uint32_t number)
{
    uint8_t bytes[FSM_RECORDS_HEAD + 5];
    uint8_t *at = fsm_records_head(bytes, fsm_records.told, FSM_RECORDS_INSTANCE);
    *at++ = (uint8_t)FSM_RECORD_NOTE;
    at = fsm_records_varint(at, number);
    fsm_records_commit(bytes, at, fsm_records.told, FSM_RECORDS_INSTANCE);
}

#ifdef FSM_INSTANCE
/* Once in a period each machine that is called until the first one is called again. */
bool fsm_records_is_due(const void *m, uint32_t now, uint32_t period)
{
    if (fsm_records.first == m) {
        fsm_records.first = NULL;
    }
    if (fsm_records.first != NULL) {
        return true;
    }
    if (now - fsm_records.synced < period) {
        return false;
    }
    fsm_records.first = m;
    fsm_records.synced = now;
    return true;
}
#endif

#ifdef FSM_RECORDS_RING

void fsm_records_sync(const uint8_t *hash, uint32_t now, const uint16_t *numbers, unsigned count,
                      uint8_t *bytes)
{
    uint32_t at = fsm_records_rtt.up.write;
    uint32_t size;
    (void)bytes;
    if (((fsm_records_rtt.up.read - at - 1u) & MASK) < 18u + 3u * count) { /* it is tried again */
        sync_soon(now);
        return;
    }
    if (fsm_records.lost > 0u) {
        at = put_lost(at, now);
    }
    at = put(at, (uint32_t)FSM_RECORD_SYNC);
    size = at; /* in two bytes, whatever it is */
    at = (at + 2u) & MASK;
    for (unsigned i = 0u; i < 4u; i++) {
        at = put(at, hash[i]);
    }
    for (unsigned i = 0u; i < 32u; i += 8u) {
        at = put(at, now >> i);
    }
    at = put_number(at, FSM_RECORDS_INSTANCE);
    for (unsigned i = 0u; i < count; i++) {
        at = put_number(at, numbers[i]);
    }
    count = (at - size - 2u) & MASK;
    (void)put(put(size, count | 0x80u), count >> 7);
    fsm_records_rtt.up.write = at;
    fsm_records.told = fsm_records.synced = now;
#ifdef FSM_INSTANCE
    fsm_records.instance = FSM_RECORDS_INSTANCE;
#endif
}

#else

void fsm_records_sync(const uint8_t *hash, uint32_t now, const uint16_t *numbers, unsigned count,
                      uint8_t *bytes)
{
    const uint16_t instance = FSM_RECORDS_INSTANCE;
    uint8_t *at = put_losses(bytes);
    fsm_writer w = fsm_write_to(at + 3u);
    uint8_t *size;
    *at++ = (uint8_t)FSM_RECORD_SYNC;
    size = at; /* in two bytes, whatever it is */
    for (unsigned i = 0u; i < 4u; i++) {
        *w.at++ = hash[i];
    }
    fsm_put(&w, now, 4u);
    at = fsm_records_varint(w.at, instance);
    for (unsigned i = 0u; i < count; i++) {
        at = fsm_records_varint(at, numbers[i]);
    }
    count = (unsigned)(at - size) - 2u;
    size[0] = (uint8_t)((count & 0x7Fu) | 0x80u);
    size[1] = (uint8_t)(count >> 7);
    if (!put_all(bytes, at, now, instance)) { /* no loss: it is tried again */
        sync_soon(now);
    } else {
        fsm_records.synced = now;
    }
}

#endif

#endif
