/* fsm_info.h: the description of a generated machine as constants: states, events, data, timers.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * X_info.c defines X_info, the description of the machine X, and X_driver, with its functions. Code
 * that saves, logs, tests or explores machines reads these and needs no code per chart. A program
 * that does not link X_info.c pays nothing. FSM_NO_NAMES omits the strings. */
#ifndef FSM_INFO_H
#define FSM_INFO_H

#include "fsm.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifdef FSM_NO_NAMES
#define FSM_TEXT(text) NULL
#else
#define FSM_TEXT(text) text
#endif

#define FSM_ABSENT UINT32_MAX /* the offset of a member that a machine does not have */

/* ---- types of values --------------------------------------------------------------------------- */

typedef enum {
    FSM_BOOL,
    FSM_UNSIGNED,
    FSM_SIGNED,
    FSM_ENUMERATION,
    FSM_DURATION, /* in ticks */
    FSM_FLOAT,
    FSM_SYMBOL,   /* the number of a string */
    FSM_ARRAY,
    FSM_RECORD
} fsm_type_kind;

typedef struct fsm_type fsm_type;

/* A variable, a field or a parameter. */
typedef struct {
    const char *name;
    const fsm_type *type;
    uint32_t offset; /* in the enclosing struct; of a parameter: 0 */
} fsm_field;

struct fsm_type {
    fsm_type_kind kind;
    uint32_t size;     /* bytes */
    uint32_t count;    /* elements of an array, fields of a record, members of an enumeration */
    uint32_t scalars;  /* in an array or a record; else 1 */
    uint64_t lo, hi;   /* bounds of a number, as two's complement if signed */
    const fsm_type *element;
    const fsm_field *fields;
    const char *const *members;
    const int32_t *numbers; /* values of the members; NULL if they count from 0 */
};

/* ---- the parts of a machine ------------------------------------------------------------------------ */

typedef enum {
    FSM_HISTORY, /* never active */
    FSM_COMPOUND,
    FSM_PARALLEL,
    FSM_ATOMIC,
    FSM_FINAL
} fsm_state_kind;

/* A state; by its number. It is active if the number of its region is one from its own to `last`. */
typedef struct {
    const char *name;
    uint16_t kind, parent, region, last;
} fsm_state_info;

/* Flags of an event: the host may post it; the host receives it; its name denotes this one. */
enum { FSM_EVENT_IN = 1, FSM_EVENT_OUT = 2, FSM_EVENT_NAMED = 4 };

/* An event; by its number less one. Offsets of fields are from the start of the event. */
typedef struct {
    const char *name;
    const fsm_field *fields;
    const fsm_type *reply; /* type of the declared reply, or NULL */
    uint16_t field_count, flags;
} fsm_event_info;

typedef struct {
    const char *name;
    const fsm_field *parameters;
    const fsm_type *result; /* NULL: none */
    uint16_t parameter_count;
} fsm_operation_info;

/* A timeout: `after` its delay, or `every` period. */
typedef struct {
    uint32_t delay, least; /* ticks; the minimum of an interval, else the delay */
    uint16_t transition, source;
    bool is_periodic;
} fsm_timeout_info;

/* The number of a region's deepest active state, or of a history's recorded state; 0 for none. A byte
 * with both meanings holds FSM_RECORDED plus the recorded number. */
typedef enum { FSM_PLAIN, FSM_ACTIVE_OF_BOTH, FSM_RECORDED_OF_BOTH } fsm_number_kind;

enum { FSM_RECORDED = 0x80, FSM_NO_NUMBER = 0xFFFF };

typedef struct {
    uint32_t offset;
    uint16_t size, region, kind;
    uint16_t state; /* of a history: the state in which its record cannot be read; FSM_NO_NUMBER */
    uint16_t history; /* FSM_NO_NUMBER: this is the number of a region */
    bool is_deep;     /* of a history */
} fsm_number;

typedef struct {
    uint32_t offset, count; /* offsets of the array and of its count */
    uint16_t room;          /* places in a saved machine */
} fsm_list_info;

typedef struct fsm_machine_info fsm_machine_info;

/* A machine in a slot, possibly nested: the machines within it follow it. */
typedef struct {
    const fsm_machine_info *info;
    const char *name; /* of its slot */
    uint32_t offset;  /* in the outermost */
    uint16_t within;  /* number of the following entries within it */
} fsm_slot;

/* Numbers that a saved machine stores as indices of a list of the chart. */
typedef struct {
    const uint16_t *numbers;
    uint16_t count;
} fsm_number_list;

struct fsm_machine_info {
    const char *name;
    uint32_t size, event_size;             /* bytes of the struct, and of that of an event */
    uint32_t event_number, event_width;    /* offset and bytes of the number of an event */
    uint32_t saved_size;                   /* bytes of a saved machine without its head and CRC */
    uint32_t payload;                      /* bytes of the longest payload there */
    uint16_t state_count, event_count, transition_count, operation_count, timeout_count;
    uint16_t region_count, number_count;   /* regions are the first of the numbers */
    uint16_t data_count, output_count, input_count, slot_count, symbol_count;
    const fsm_state_info *states;
    const fsm_event_info *events;
    const fsm_field *variables;            /* data, outputs, inputs */
    const fsm_operation_info *operations;
    const fsm_timeout_info *timeouts;
    const fsm_number *numbers;
    const fsm_slot *slots;
    fsm_list_info queue, internal, deferred, timers, delayed;
    uint32_t delayed_size, delayed_route, delayed_peer; /* of an entry; its event comes first */
    fsm_number_list routes, marks, peers, texts;
    uint32_t running, finished, fault, busy, now, reply; /* offsets of members */
    const fsm_type *reply_type;
    const uint8_t *head;                   /* of saved bytes; NULL for a machine in a slot */
    void (*init)(void *m);
    const char *(*symbol)(uint32_t number);
};

/* The functions of a machine; NULL for a missing one. */
typedef struct fsm_driver {
    const fsm_machine_info *info;
    void (*start)(void *m, uint32_t now);
    void (*run)(void *m, uint32_t now);
    bool (*post)(void *m, const void *e);
    fsm_result (*dispatch)(void *m, const void *e, uint32_t now);
    bool (*next_deadline)(const void *m, uint32_t *deadline);
    bool (*save)(const void *m, uint32_t now, uint8_t *bytes);
    fsm_restored (*restore)(void *m, uint32_t now, const uint8_t *bytes, size_t size);
} fsm_driver;

/* ---- reading them ------------------------------------------------------------------------------ */

/* The value at an offset. */
static inline const void *fsm_at(const void *holder, uint32_t offset)
{
    return (const unsigned char *)holder + offset;
}

static inline void *fsm_place_at(void *holder, uint32_t offset)
{
    return (unsigned char *)holder + offset;
}

static inline uint64_t fsm_load_bits(const void *place, uint32_t size)
{
    switch (size) {
    case 1u:
        return *(const uint8_t *)place;
    case 2u:
        return *(const uint16_t *)place;
    case 4u:
        return *(const uint32_t *)place;
    default:
        return *(const uint64_t *)place;
    }
}

static inline void fsm_store_bits(void *place, uint32_t size, uint64_t bits)
{
    switch (size) {
    case 1u:
        *(uint8_t *)place = (uint8_t)(bits & 0xFFu);
        break;
    case 2u:
        *(uint16_t *)place = (uint16_t)(bits & 0xFFFFu);
        break;
    case 4u:
        *(uint32_t *)place = (uint32_t)(bits & 0xFFFFFFFFu);
        break;
    default:
        *(uint64_t *)place = bits;
        break;
    }
}

typedef union {
    float value;
    uint32_t bits;
} fsm_float_bits;

typedef union {
    double value;
    uint64_t bits;
} fsm_double_bits;

/* Whether values of a type have a sign: of an enumeration some member is below 0. */
static inline bool fsm_is_signed(const fsm_type *type)
{
    return type->kind == FSM_SIGNED || (type->kind == FSM_ENUMERATION && type->lo >> 63 != 0u);
}

/* A number with a sign in fewer than 64 bits, as that in 64 bits. */
static inline uint64_t fsm_extended(const fsm_type *type, uint64_t bits)
{
    if (fsm_is_signed(type) && type->size < 8u && (bits >> (8u * type->size - 1u)) != 0u) {
        bits |= UINT64_MAX << (8u * type->size);
    }
    return bits;
}

/* The bits of a scalar: of a whole number with its sign as 64; of a float its own. */
static inline uint64_t fsm_bits_at(const fsm_type *type, const void *place)
{
    fsm_float_bits narrow;
    fsm_double_bits wide;
    if (type->kind != FSM_FLOAT) {
        return fsm_extended(type, fsm_load_bits(place, type->size));
    }
    if (type->size == 4u) {
        narrow.value = *(const float *)place;
        return narrow.bits;
    }
    wide.value = *(const double *)place;
    return wide.bits;
}

/* The reverse. */
static inline void fsm_set_bits(const fsm_type *type, void *place, uint64_t bits)
{
    fsm_float_bits narrow;
    fsm_double_bits wide;
    if (type->kind != FSM_FLOAT) {
        fsm_store_bits(place, type->size, bits);
    } else if (type->size == 4u) {
        narrow.bits = (uint32_t)(bits & 0xFFFFFFFFu);
        *(float *)place = narrow.value;
    } else {
        wide.bits = bits;
        *(double *)place = wide.value;
    }
}

/* A float of either size. */
static inline double fsm_float_at(const fsm_type *type, const void *place)
{
    return type->size == 4u ? (double)*(const float *)place : *(const double *)place;
}

static inline void fsm_set_float(const fsm_type *type, void *place, double value)
{
    if (type->size == 4u) {
        *(float *)place = (float)value;
    } else {
        *(double *)place = value;
    }
}

/* Whether the bits of a scalar are those of a value of its type; those of a float always are. */
static inline bool fsm_is_of(const fsm_type *type, uint64_t bits)
{
    const uint64_t sign = fsm_is_signed(type) ? (uint64_t)1u << 63 : 0u;
    if (type->kind == FSM_ENUMERATION && type->numbers != NULL) {
        for (uint32_t i = 0u; i < type->count; i++) {
            if ((uint64_t)(int64_t)type->numbers[i] == bits) {
                return true;
            }
        }
        return false;
    }
    return type->kind == FSM_FLOAT
           || ((bits ^ sign) >= (type->lo ^ sign) && (bits ^ sign) <= (type->hi ^ sign));
}

/* The scalar number `k` of a value: its type; `*offset` becomes where it lies from there on. */
static inline const fsm_type *fsm_scalar(const fsm_type *type, uint32_t k, uint32_t *offset)
{
    while (type->kind >= FSM_ARRAY) {
        if (type->kind == FSM_ARRAY) {
            const uint32_t each = type->element->scalars;
            const uint32_t place = each == 1u ? k : k / each;
            k -= place * each;
            *offset += place * type->element->size;
            type = type->element;
        } else {
            const fsm_field *field = type->fields;
            while (k >= field->type->scalars) {
                k -= field->type->scalars;
                field++;
            }
            *offset += field->offset;
            type = field->type;
        }
    }
    return type;
}

/* The number of an event. */
static inline uint32_t fsm_event_of(const fsm_machine_info *info, const void *e)
{
    return (uint32_t)fsm_load_bits(fsm_at(e, info->event_number), info->event_width);
}

/* The number of a region's deepest active state, or of a history's record; 0 for none. */
static inline uint32_t fsm_number_at(const fsm_number *number, const void *m)
{
    uint32_t value = 0u;
    if (number->offset != FSM_ABSENT) {
        value = (uint32_t)fsm_load_bits(fsm_at(m, number->offset), number->size);
    }
    if (number->kind == FSM_ACTIVE_OF_BOTH) {
        return value < FSM_RECORDED ? value : 0u;
    }
    if (number->kind == FSM_RECORDED_OF_BOTH) {
        return value > FSM_RECORDED ? value - FSM_RECORDED : 0u;
    }
    return value;
}

static inline bool fsm_is_running(const fsm_machine_info *info, const void *m)
{
    if (info->running != FSM_ABSENT) {
        return *(const bool *)fsm_at(m, info->running);
    }
    return fsm_number_at(&info->numbers[0], m) != 0u;
}

/* Whether a state is active. */
static inline bool fsm_is_active(const fsm_machine_info *info, const void *m, uint32_t state)
{
    const fsm_state_info *of = &info->states[state];
    if (state == 0u) {
        return fsm_is_running(info, m);
    }
    const uint32_t number = fsm_number_at(&info->numbers[of->region], m);
    return number >= state && number <= of->last;
}

/* ---- for generated code ------------------------------------------------------------------------ */

/* Functions of a machine X that take the machine and events by any pointer. */
#define FSM_DEFINE_INIT(X)                                                                         \
    static void fsm_##X##_init(void *m)                                                            \
    {                                                                                              \
        X##_init((X *)m);                                                                          \
    }
#define FSM_DEFINE_DRIVER(X)                                                                       \
    static void fsm_##X##_start(void *m, uint32_t now)                                             \
    {                                                                                              \
        X##_start((X *)m, now);                                                                    \
    }                                                                                              \
    static fsm_result fsm_##X##_dispatch(void *m, const void *e, uint32_t now)                     \
    {                                                                                              \
        return X##_dispatch((X *)m, (const X##_event *)e, now);                                    \
    }                                                                                              \
    static bool fsm_##X##_next_deadline(const void *m, uint32_t *deadline)                         \
    {                                                                                              \
        return X##_next_deadline((const X *)m, deadline);                                          \
    }
#define FSM_DEFINE_POST(X)                                                                         \
    static bool fsm_##X##_post(void *m, const void *e)                                             \
    {                                                                                              \
        return X##_post((X *)m, (const X##_event *)e);                                             \
    }
#define FSM_DEFINE_RUN(X)                                                                          \
    static void fsm_##X##_run(void *m, uint32_t now)                                               \
    {                                                                                              \
        X##_run((X *)m, now);                                                                      \
    }
#define FSM_DEFINE_SAVE(X)                                                                         \
    static bool fsm_##X##_save(const void *m, uint32_t now, uint8_t *bytes)                        \
    {                                                                                              \
        return X##_save((const X *)m, now, bytes);                                                 \
    }                                                                                              \
    static fsm_restored fsm_##X##_restore(void *m, uint32_t now, const uint8_t *bytes, size_t size) \
    {                                                                                              \
        return X##_restore((X *)m, now, bytes, size);                                              \
    }

#ifdef __cplusplus
}
#endif

#endif
