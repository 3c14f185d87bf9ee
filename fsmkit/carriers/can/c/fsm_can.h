/* fsm_can.h: the bits of CAN messages, by tables: values of a link's payload out of a frame, and into it.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * `fsmkit compile` of a deployment writes the tables from the DBC file of a foreign node
 * (fsm_link_can.h). A signal is an integer in units of its factor: its value is the raw one with
 * another sign and a shift, so nothing is rounded. No allocation, no state, no floating point. */
#ifndef FSM_CAN_H
#define FSM_CAN_H

#include "fsm_link.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FSM_CAN_EXTENDED 0x80000000u /* of an identifier, as struct can_frame of Linux has it */
#define FSM_CAN_REMOTE 0x40000000u   /* a request without data */
#define FSM_CAN_ERROR 0x20000000u    /* an error frame: linux/can/error.h */
#define FSM_CAN_BUS_OFF 0x40u        /* of an error frame: the controller has left the bus */
#define FSM_CAN_BYTES 64u            /* of a frame of CAN FD; 8 of a classical one */
#define FSM_CAN_NOWHERE 0xffffu      /* in place of a number of the event map */

enum { /* of a signal */
    FSM_CAN_BIG = 1,          /* big-endian: its next higher byte is the one before */
    FSM_CAN_SIGNED = 2,       /* the raw value is */
    FSM_CAN_NEGATED = 4,      /* value = shift - raw; else raw + shift */
    FSM_CAN_SELECTS = 8,      /* a multiplexer: another value is for another message */
    FSM_CAN_FLOAT = 16,       /* IEEE 754 */
    FSM_CAN_SIGNED_VALUE = 32 /* the value in the payload has a sign */
};

typedef struct {
    uint16_t lowest; /* where its lowest bit is: 8 * byte + bit */
    uint8_t bits;    /* 1 to 64 */
    uint8_t flags;
    uint16_t at;          /* of the value in the payload */
    uint8_t size;         /* its bytes there; 0: it has no place */
    uint16_t members;     /* of an enumeration, whose values are places among them; 0: not an enumeration */
    const int64_t *raw;   /* of each member */
    uint64_t least, most; /* raw; in two's complement where it is signed */
    uint64_t shift;       /* modulo 2^64; of a signal without a place: the raw value to send */
} fsm_can_signal;

typedef struct {
    uint32_t id;       /* with FSM_CAN_EXTENDED */
    uint16_t message;  /* of the event map, FSM_LINK_LEVELS or FSM_CAN_NOWHERE */
    uint32_t cycle_ms; /* 0: it comes as an event */
    uint8_t length;    /* bytes */
    bool is_fd;
    uint16_t signals;
    const fsm_can_signal *signal;
} fsm_can_message;

typedef enum {
    FSM_CAN_TAKEN,
    FSM_CAN_OTHER,  /* its multiplexer has a value of another message */
    FSM_CAN_REFUSED /* too short, or a value is out of its range */
} fsm_can_result;

typedef struct {
    uint16_t received; /* the place of a cyclic message among those received */
    uint16_t message;  /* the event that says that it has stopped */
} fsm_can_silence;

/* The messages between a node and an external one; generated. */
typedef struct {
    uint8_t peer;         /* the foreign node, by its place in the deployment */
    uint16_t levels;      /* bytes of its levels */
    const uint8_t *start; /* its levels, until messages with them come */
    uint16_t received_count, sent_count, silence_count;
    const fsm_can_message *received;
    const fsm_can_message *sent;
    const fsm_can_silence *silence;
} fsm_can_node;

/* A bus that nodes of fsmkit share; generated. Byte 0 of events and levels counts the frames of the
 * message; `hello` has the hash (4 bytes), the session and the events sent (2 each). */
typedef struct {
    uint32_t hash; /* of the event map and of these tables */
    uint8_t nodes;
    uint16_t events;                /* of the event map */
    const fsm_can_message *message; /* [events + 2 * nodes]: events, levels of each node, and its
                                       hello; one without bytes is not on this bus */
} fsm_can_net;

/* Write the values of a frame into a payload; only if it is taken. */
fsm_can_result fsm_can_decode(const fsm_can_message *message, const uint8_t *data, size_t length,
                              uint8_t *payload);

/* Write `message->length` bytes with the values of a payload; false if one is out of its range. */
bool fsm_can_encode(const fsm_can_message *message, const uint8_t *payload, uint8_t *data);

#ifdef __cplusplus
}
#endif

#endif
