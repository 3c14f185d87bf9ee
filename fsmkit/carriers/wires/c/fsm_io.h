/* fsm_io.h: what the generated wires of a board (X_io.c) stand on.
 *
 * Integers only; nothing is allocated, no memory is kept here, and every loop is bounded by a table. */
#ifndef FSM_IO_H
#define FSM_IO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    FSM_IO_DIGITAL_IN,
    FSM_IO_COUNTER,
    FSM_IO_ANALOG_IN,
    FSM_IO_NUMBER_IN,
    FSM_IO_DIGITAL_OUT, /* from here on outputs */
    FSM_IO_PWM,
    FSM_IO_NUMBER_OUT
} fsm_io_kind;

/* A wire: a member of the raw image, an int32_t at `offset`. A backend moves it. */
typedef struct {
    const char *name;
    size_t offset;
    uint16_t number; /* among the wires of its kind */
    uint8_t kind;    /* fsm_io_kind */
    uint8_t bits;    /* of a counter or a converter, else 32; of a digital wire 1 */
    int32_t safe;    /* what an output is before the first cycle, and where all is off */
    int32_t full;    /* the greatest value of a pwm, else 0 */
    bool is_kept;    /* an output that stays as it is where all others are safe */
} fsm_io_wire;

static inline bool fsm_io_is_output(const fsm_io_wire *wire)
{
    return wire->kind >= FSM_IO_DIGITAL_OUT;
}

static inline int32_t *fsm_io_at(void *image, const fsm_io_wire *wire)
{
    return (int32_t *)(void *)((unsigned char *)image + wire->offset);
}

static inline const int32_t *fsm_io_in(const void *image, const fsm_io_wire *wire)
{
    return (const int32_t *)(const void *)((const unsigned char *)image + wire->offset);
}

/* The location of a wire in a window of registers (fsm_io_map.h). Wires of one register are adjacent in
 * their table. */
typedef struct {
    uint32_t offset; /* bytes; a multiple of the access */
    uint16_t wire;   /* its place in the table of wires */
    uint8_t access;  /* 8, 16 or 32 bits */
    uint8_t shift, bits;
    bool is_signed; /* in two's complement there */
} fsm_io_register;

/* A raw value and what it means; between two points the scale is a straight line. */
typedef struct {
    int32_t raw, value;
} fsm_io_point;

/* A counter of `bits` bits, taken on in 32. */
typedef struct {
    uint32_t last;
    bool has_last;
} fsm_io_counter;

/* A converter: its filter, in 1/65536, and how many readings in a row were not valid. */
typedef struct {
    int64_t filtered;
    uint16_t invalid; /* stops at 65535 */
    bool has_value;
} fsm_io_converter;

typedef struct {
    const fsm_io_point *points; /* ascending by raw; at least two */
    uint16_t count;
    uint16_t lowpass; /* time constant in readings; 0: no filter */
    int32_t least, greatest; /* raw, that are valid */
} fsm_io_scale;

/* A bit that changes once `readings` in a row differ from it. */
void fsm_io_debounce(bool *value, uint16_t *count, bool reading, uint16_t readings);

/* Add the change of a counter since the last reading, in the shorter direction; modulo 2^32. */
void fsm_io_count(int32_t *value, fsm_io_counter *counter, int32_t raw, uint8_t bits);

/* Take in a raw value of a converter: scaled and filtered if it is valid, else only counted. */
void fsm_io_convert(int32_t *value, fsm_io_converter *converter, const fsm_io_scale *scale,
                    int32_t raw);

/* Take in a number if it is within its range, else only count that it was not. */
void fsm_io_number(int32_t *value, uint16_t *invalid, int32_t raw, int32_t least, int32_t greatest);

/* On above the upper threshold, off below the lower one. */
void fsm_io_hysteresis(bool *value, int32_t signal, int32_t above, int32_t below);

/* Set the outputs of a raw image to their safe values, except those that are kept. When a loop hangs
 * (fsm_watch.h), another context does this with a copy of the last image, and writes it by a backend. */
void fsm_io_switch_off(const fsm_io_wire *wires, size_t count, void *raw);

int32_t fsm_io_clamp(int32_t value, int32_t least, int32_t greatest);

#ifdef __cplusplus
}
#endif

#endif
