/* fsm_records.h: a live trace of machines, as records of 1 to 4 bytes.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * Compile X_records.c instead of X.c, and fsm_records.c, all with the same of these:
 *
 *   FSM_TRACE_LEVEL     0: nothing, at no cost; 1: transitions, thus states; 2: also inputs, events
 *   FSM_TRACE_SIZE      bytes of the ring; a power of two, at least 64; 1024
 *   FSM_TRACE_SYNC      ticks between two complete states; a second
 *   FSM_TRACE_PUT(b, n) the destination of records instead of the ring: stores all n bytes and
 *                       returns true, or none and returns false
 *   FSM_INSTANCE(m)     a number for the machine at m, if there are several (16 bits)
 *   FSM_TRACE_INSTANCES level 2: instances whose inputs are stored, from 0 on; 1
 *   FSM_TRACE_CONTEXT   a word, for a second thread that runs machines: compile its X_records.c and
 *                       fsm_records.c once more with it; names of this file end in _ and the word
 *   FSM_TRACE_STATE     the name of a pointer to the state of the current machine's trace, for a host
 *                       that separates the records of each machine; with FSM_TRACE_PUT
 *
 * docs/reference/trace.md describes the records. Only the context that runs the machines writes the
 * ring. It is in a block that debug probes find by its id, "SEGGER RTT", and read while the processor
 * runs. A full ring drops and counts new records. */
#ifndef FSM_RECORDS_H
#define FSM_RECORDS_H

#include "fsm_bytes.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_TRACE_LEVEL
#define FSM_TRACE_LEVEL 0
#endif
#ifndef FSM_TRACE_SIZE
#define FSM_TRACE_SIZE 1024
#endif
#ifndef FSM_TRACE_INSTANCES
#define FSM_TRACE_INSTANCES 1
#endif

#ifdef FSM_TRACE_CONTEXT
#define FSM_CONTEXT_PASTE(a, b) a##_##b
#define FSM_CONTEXT_JOIN(a, b) FSM_CONTEXT_PASTE(a, b)
#define FSM_CONTEXT_NAME(name) FSM_CONTEXT_JOIN(name, FSM_TRACE_CONTEXT)
#define fsm_records FSM_CONTEXT_NAME(fsm_records)
#define fsm_records_rtt FSM_CONTEXT_NAME(fsm_records_rtt)
#define fsm_records_take FSM_CONTEXT_NAME(fsm_records_take)
#define fsm_records_frame FSM_CONTEXT_NAME(fsm_records_frame)
#define fsm_records_note FSM_CONTEXT_NAME(fsm_records_note)
#define fsm_records_byte FSM_CONTEXT_NAME(fsm_records_byte)
#define fsm_records_any FSM_CONTEXT_NAME(fsm_records_any)
#define fsm_records_is_due FSM_CONTEXT_NAME(fsm_records_is_due)
#define fsm_records_sync FSM_CONTEXT_NAME(fsm_records_sync)
#define fsm_records_head FSM_CONTEXT_NAME(fsm_records_head)
#define fsm_records_varint FSM_CONTEXT_NAME(fsm_records_varint)
#define fsm_records_numbered FSM_CONTEXT_NAME(fsm_records_numbered)
#define fsm_records_commit FSM_CONTEXT_NAME(fsm_records_commit)
#define fsm_records_offer FSM_CONTEXT_NAME(fsm_records_offer)
#endif

/* ---- the ring ---------------------------------------------------------------------------------- */

#ifndef FSM_TRACE_PUT
#define FSM_TRACE_PUT(bytes, n) fsm_records_put(bytes, n)
#define FSM_RECORDS_RING

/* A channel, and the block that holds it. */
typedef struct {
    const char *name;
    volatile uint8_t *bytes;
    uint32_t size;
    volatile uint32_t write; /* where the next byte goes */
    volatile uint32_t read;  /* where the next byte is read; equal: empty */
    uint32_t flags;          /* 0: bytes that do not fit are dropped */
} fsm_records_channel;

typedef struct {
    char id[16];
    int32_t ups, downs;
    fsm_records_channel up;
} fsm_records_block;

extern fsm_records_block fsm_records_rtt;
#endif

/* Remove the oldest bytes from the ring, at most `room`; return their number. For transports other
 * than debug probes; one reader only. */
size_t fsm_records_take(uint8_t *bytes, size_t room);

enum { FSM_FRAME_MOST = 240, FSM_FRAME_BYTES = 1 + 1 + FSM_FRAME_MOST + 2 + 1 };

/* Remove bytes from the ring as a frame for a serial line: COBS of a sequence number, at most 240
 * bytes of records and a CRC-16/CCITT, then a zero. Returns the size of the frame, 0 for nothing.
 * `frame`: room for FSM_FRAME_BYTES. */
size_t fsm_records_frame(uint8_t *frame);

/* Put a number into the trace. */
void fsm_records_note(uint32_t number);

/* ---- for generated code ------------------------------------------------------------------------ */

#ifdef FSM_INSTANCE
#define FSM_INSTANCE_OF(m) ((uint16_t)FSM_INSTANCE(m))
#else
#define FSM_INSTANCE_OF(m) ((uint16_t)0u)
#endif

enum {
    FSM_RECORD_TIME = 0x70,
    FSM_RECORD_LOST,
    FSM_RECORD_INSTANCE,
    FSM_RECORD_SYNC,
    FSM_RECORD_FAR,
    FSM_RECORD_SNAPSHOT,
    FSM_RECORD_END,
    FSM_RECORD_NOTE,
    FSM_RECORD_RESTORE,
    FSM_RECORD_SHORT_TIME = 0x80, /* and the ticks */
    FSM_RECORDS_DIRECT = 112,     /* numbers below take one byte */
    FSM_RECORDS_FAR = 0x100,
    FSM_RECORDS_HEAD = 24         /* bytes before a payload: losses 6, instance 4, time 6, number 7 */
};

/* A call of the host that is being recorded. */
typedef struct {
    uint32_t now;
#ifdef FSM_INSTANCE
    uint16_t instance;
#endif
#if FSM_TRACE_LEVEL >= 2
    bool is_open;       /* it has records, so its end is recorded */
    bool is_dispatched; /* the current event was dispatched, and is not yet recorded */
#endif
} fsm_records_call;

typedef struct {
    fsm_records_call call;
    uint32_t told;   /* the last recorded time */
    uint32_t synced; /* when the last complete states were recorded */
#ifdef FSM_INSTANCE
    const void *first; /* the first machine of that round, while it is incomplete */
    uint16_t instance; /* the last recorded instance */
#endif
    uint16_t lost; /* records lost since the last stored one */
#ifdef FSM_TRACE_STATE
    void *inputs; /* as last recorded */
#endif
} fsm_records_state;

#ifdef FSM_TRACE_STATE
extern fsm_records_state *FSM_TRACE_STATE;
#define fsm_records (*FSM_TRACE_STATE)
#else
extern fsm_records_state fsm_records;
#endif

#ifdef FSM_INSTANCE
#define FSM_RECORDS_INSTANCE fsm_records.call.instance
#else
#define FSM_RECORDS_INSTANCE ((uint16_t)0u)
#endif

/* Start and end a call; calls may be nested. */
static inline fsm_records_call fsm_records_enter(uint16_t instance, uint32_t now)
{
    const fsm_records_call outer = fsm_records.call;
    fsm_records.call.now = now;
#ifdef FSM_INSTANCE
    fsm_records.call.instance = instance;
#else
    (void)instance;
#endif
#if FSM_TRACE_LEVEL >= 2
    fsm_records.call.is_open = false;
    fsm_records.call.is_dispatched = false;
#endif
    return outer;
}

/* Write a record of one byte; or of one byte, or FSM_RECORDS_FAR plus the number beyond those of one
 * byte. */
void fsm_records_byte(uint32_t now, uint32_t first, uint16_t instance);
void fsm_records_any(uint32_t now, uint32_t first, uint16_t instance);
#define FSM_RECORDS_NUMBER(now, number, instance)                                                  \
    ((number) < (uint32_t)FSM_RECORDS_DIRECT                                                       \
         ? fsm_records_byte(now, number, instance)                                                 \
         : fsm_records_any(now, (number) + FSM_RECORDS_FAR - FSM_RECORDS_DIRECT, instance))

static inline void fsm_records_leave(fsm_records_call outer)
{
#if FSM_TRACE_LEVEL >= 2
    if (fsm_records.call.is_open) {
        fsm_records_byte(fsm_records.call.now, (uint32_t)FSM_RECORD_END, FSM_RECORDS_INSTANCE);
    }
#endif
    fsm_records.call = outer;
}

/* Return whether the complete state of a machine is to be recorded now. */
#ifdef FSM_INSTANCE
bool fsm_records_is_due(const void *m, uint32_t now, uint32_t period);
#else
static inline bool fsm_records_is_due(const void *m, uint32_t now, uint32_t period)
{
    (void)m;
    return now - fsm_records.synced >= period;
}
#endif

/* Record it. `numbers`: status, fault, then states; `bytes`: room for the record. */
void fsm_records_sync(const uint8_t *hash, uint32_t now, const uint16_t *numbers, unsigned count,
                      uint8_t *bytes);
#ifdef FSM_RECORDS_RING
#define FSM_RECORDS_SYNC_BYTES(count) 1u /* it is written in place */
#else
#define FSM_RECORDS_SYNC_BYTES(count) (FSM_RECORDS_HEAD + 16u + 3u * (count))
#endif

/* Write the prefix of a record, and its number; store the written bytes. */
uint8_t *fsm_records_head(uint8_t *at, uint32_t now, uint16_t instance);
uint8_t *fsm_records_varint(uint8_t *at, uint32_t value);
uint8_t *fsm_records_numbered(uint8_t *at, uint32_t number);
void fsm_records_commit(const uint8_t *bytes, const uint8_t *end, uint32_t now, uint16_t instance);

/* The same, but a record that does not fit is repeated later instead of lost. */
void fsm_records_offer(const uint8_t *bytes, const uint8_t *end, uint32_t now, uint16_t instance);

/* Store a value; return whether it equals the stored one. */
static inline bool fsm_records_keeps(const void *value, void *kept, size_t size)
{
    const unsigned char *from = (const unsigned char *)value;
    unsigned char *to = (unsigned char *)kept;
    bool is_same = true;
    for (size_t i = 0u; i < size; i++) {
        if (to[i] != from[i]) {
            is_same = false;
            to[i] = from[i];
        }
    }
    return is_same;
}

#ifdef __cplusplus
}
#endif

#endif
