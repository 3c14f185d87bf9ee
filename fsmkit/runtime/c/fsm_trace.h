/* fsm_trace.h: the last transitions of machines in a ring; their inputs in a log for replay.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * Compile X_trace.c instead of X.c, and fsm_trace.c; to log, X_info.c too. The machine X is used
 * unchanged.
 *
 *   FSM_TRACE_RECORDS  transitions that the ring holds, 12 bytes each; a power of two, or 0: no ring
 *   FSM_LOGGED            defined: everything is passed to fsm_log_write, which the host defines
 *   FSM_INSTANCE(m)    a number for the machine at m, if there are several (16 bits)
 *
 * All machines of a context share both. If several threads run machines, protect fsm_log_write and
 * all steps by one lock. */
#ifndef FSM_TRACE_H
#define FSM_TRACE_H

#include "fsm_bytes.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_TRACE_RECORDS
#define FSM_TRACE_RECORDS 64
#endif
#ifndef FSM_INSTANCE
#define FSM_INSTANCE(m) 0u
#endif

/* ---- the ring ---------------------------------------------------------------------------------- */

/* A transition that was taken. */
typedef struct {
    uint32_t time;       /* of its macrostep, in ticks */
    uint16_t instance;   /* FSM_INSTANCE */
    uint16_t machine;    /* 0; in a slot: its number among those of the chart, in their order */
    uint16_t event;      /* the number of the event that caused the macrostep; 0 for none */
    uint16_t transition; /* its index */
} fsm_trace_record;

enum { FSM_TRACE_TIMEOUT = 0xFFFF /* instead of an event */, FSM_TRACE_HEAD = 8 };

#define FSM_TRACE_BYTES (FSM_TRACE_HEAD + 12u * (FSM_TRACE_RECORDS))

/* Write the ring, oldest first, into FSM_TRACE_BYTES; return the number of bytes. */
size_t fsm_trace_dump(uint8_t *bytes);

/* Empty the ring. */
void fsm_trace_clear(void);

/* ---- the log -----------------------------------------------------------------------------------
 * Each record: its kind, the size of the rest (2 bytes), the rest; least significant bytes first. */

typedef enum {
    FSM_LOG_START = 1, /* instance, now, inputs, hash of the chart */
    FSM_LOG_RUN,       /* instance, now, inputs; runs without work are omitted */
    FSM_LOG_DISPATCH,  /* instance, now, inputs, event */
    FSM_LOG_POST,      /* instance, whether there was room, event */
    FSM_LOG_CALLED,    /* machine, operation, its result */
    FSM_LOG_TAKEN,     /* machine, transition */
    FSM_LOG_END,       /* ends the last open start, run or dispatch */
    FSM_LOG_RESTORE    /* instance, now, the saved machine */
} fsm_log_kind;

#ifdef FSM_LOGGED
/* Store some bytes, in a file for instance; defined by the host. */
void fsm_log_write(const uint8_t *bytes, size_t size);
#endif

/* ---- for generated code ------------------------------------------------------------------------ */

void fsm_trace_at(uint32_t now);
void fsm_trace_cause(uint16_t event);
void fsm_trace_take(uint16_t instance, uint16_t machine, uint32_t time, uint16_t transition);
uint32_t fsm_trace_time(void);
void fsm_log_record(fsm_log_kind kind, const uint8_t *bytes, size_t size);
void fsm_log_restored(uint16_t instance, uint32_t now, const uint8_t *bytes, size_t size);

/* `bytes`: room for the record. `m`: with its inputs; `e`: NULL for a call without an event. */
void fsm_log_call(fsm_log_kind kind, const fsm_machine_info *info, uint16_t instance, const void *m,
                  const void *e, uint32_t now, uint8_t *bytes);
void fsm_log_post(const fsm_machine_info *info, uint16_t instance, const void *e, bool fits,
                  uint8_t *bytes);
void fsm_log_called(const fsm_machine_info *info, uint16_t machine, uint16_t operation,
                    const void *result, uint8_t *bytes);

/* Whether a run finds nothing to do; false where that is unknown. */
bool fsm_is_idle(const fsm_machine_info *info, const void *m, uint32_t now);

#ifdef __cplusplus
}
#endif

#endif
