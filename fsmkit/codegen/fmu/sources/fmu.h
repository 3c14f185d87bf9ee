/* fmu.h: generated machines as an FMU, whatever machines and whatever version of FMI.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef FMU_H
#define FMU_H

#include "fmu_model.h"

#ifndef FMU_INSTANCES
#define FMU_INSTANCES 8 /* at once; there is no allocation */
#endif
#ifndef FMU_STATES
#define FMU_STATES 32 /* the maximum of copies that fmi2GetFMUstate and fmi3GetFMUState return */
#endif
#ifndef FMU_POSTED
#define FMU_POSTED 65535u /* by how much a counter of events may grow in a step */
#endif
#ifndef FMU_PENDING
#define FMU_PENDING 64 /* events and calls that wait for their iteration */
#endif

typedef enum {
    FMU_TIME,
    FMU_VARIABLE,  /* of the machine */
    FMU_REGION,    /* its deepest active state */
    FMU_IN,        /* an event that is posted; its fields follow it */
    FMU_OUT,       /* an event that leaves; likewise */
    FMU_CALL,      /* an operation; its parameters follow it */
    FMU_FIELD,     /* of an event, either way */
    FMU_PARAMETER,
    FMU_RESULT,    /* the value that an operation returns */
    FMU_DEADLINE
} fmu_source;

typedef enum {
    FMU_AS_BOOLEAN, FMU_AS_ENUMERATION, FMU_AS_CLOCK, FMU_AS_INTEGER, FMU_AS_REAL,
    FMU_AS_INT8, FMU_AS_UINT8, FMU_AS_INT16, FMU_AS_UINT16,
    FMU_AS_INT32, FMU_AS_UINT32, FMU_AS_INT64, FMU_AS_UINT64,
    FMU_AS_FLOAT32, FMU_AS_FLOAT64
} fmu_representation;

/* A variable of the FMU; its reference is its place in the table. */
typedef struct {
    uint8_t source, as;
    uint16_t part;          /* the machine that it belongs to */
    uint16_t number, field; /* of the variable, region, event, operation; of the field */
    uint32_t scalar;        /* which of the scalars of an array or a record */
    bool is_input;
} fmu_row;

extern const fmu_row fmu_rows[FMU_COUNT];

/* A machine: of a system, where it is in its struct. */
typedef struct {
    const fsm_driver *driver;
    size_t offset;
} fmu_part;

extern const fmu_part fmu_parts[FMU_PARTS];

/* Generated functions for all machines. Run: false if they do not become idle. */
void fmu_model_init(fmu_machine *m);
void fmu_model_start(fmu_machine *m, uint32_t now);
bool fmu_model_run(fmu_machine *m, uint32_t now);
bool fmu_model_next_deadline(const fmu_machine *m, uint32_t *deadline);

typedef struct {
    uint32_t reference; /* of the event or operation */
    uint64_t bits[FMU_WIDEST];
} fmu_message;

/* The state that a step can change: bytes without a pointer, so a copy is a snapshot. */
typedef struct {
    fmu_machine machine; /* or the system with all of them */
    uint64_t held[FMU_COUNT]; /* payloads, results, counters, Clocks */
    uint64_t posted[FMU_COUNT]; /* counters of events in that were posted */
    fmu_message pending[FMU_PENDING];
    uint32_t pending_first, pending_count;
    double time, start;
    bool is_overrun;  /* more messages were pending than fit */
    bool is_restless; /* machines that send to each other endlessly */
} fmu_state;

typedef struct {
    fmu_state state;
    bool is_taken, with_events, returns_early, is_counting, is_new;
    void *environment;
    void (*logger)(void); /* of its version of FMI */
} fmu_instance;

typedef struct {
    fmu_state state;
    bool is_taken;
} fmu_copy;

fmu_instance *fmu_take(void);         /* NULL: none is free */
void fmu_reset(fmu_instance *i);
void fmu_start(fmu_instance *i);
void fmu_run(fmu_instance *i);        /* post the set events, then run until the current time */
bool fmu_next(fmu_instance *i);       /* make the next message current; false: no message */
bool fmu_deadline(const fmu_instance *i, double *at);
bool fmu_is_due_within(const fmu_instance *i, double end, double *at); /* after now, in ticks */
const char *fmu_trouble(const fmu_instance *i); /* why no step is possible; NULL */
bool fmu_get(const fmu_instance *i, uint32_t reference, uint64_t *bits);
bool fmu_set(fmu_instance *i, uint32_t reference, uint64_t bits); /* false: out of range */
const fsm_type *fmu_type(const fmu_row *row, uint32_t *offset);   /* NULL: without one */
fmu_copy *fmu_save(const fmu_instance *i, fmu_copy *over);        /* NULL: none is free */
bool fmu_import(fmu_state *state, const unsigned char *bytes, size_t size);
void fmu_export(const fmu_state *state, unsigned char *bytes);
/* The token, a checksum, and the state. */
#define FMU_SAVED_BYTES (sizeof FMU_TOKEN + sizeof(uint64_t) + sizeof(fmu_state))

#endif
