/* fsm_can_bus.h: frames of a CAN bus: of SocketCAN (Linux), or of UDP multicast within this computer.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * Both carry the same bytes: `struct can_frame` of a classical frame, `struct canfd_frame` of one of
 * CAN FD (linux/can.h). Multicast is for tests and simulations: it has no arbitration and no errors
 * of its own. */
#ifndef FSM_CAN_BUS_H
#define FSM_CAN_BUS_H

#include "fsm_can.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As struct canfd_frame. */
typedef struct {
    uint32_t id; /* with FSM_CAN_EXTENDED, FSM_CAN_REMOTE, FSM_CAN_ERROR */
    uint8_t length;
    uint8_t flags;
    uint8_t reserved[2];
    uint8_t data[FSM_CAN_BYTES];
} fsm_can_frame;

typedef struct {
    int in, out; /* descriptors; of SocketCAN the same */
} fsm_can_bus;

/* Open a bus: the name of an interface, as `can0`; or `udp:239.74.163.2:43113`, a group and a port.
 * Of SocketCAN only messages with these identifiers come, and error frames. 0, or an errno. */
int fsm_can_bus_open(fsm_can_bus *bus, const char *name, const fsm_can_message *wanted,
                     unsigned count);

/* Send a frame; false if it does not go at once. */
bool fsm_can_bus_send(const fsm_can_bus *bus, const fsm_can_frame *frame, bool is_fd);

/* Take a received frame; false if there was no frame. Never blocks. */
bool fsm_can_bus_receive(const fsm_can_bus *bus, fsm_can_frame *frame);

void fsm_can_bus_close(fsm_can_bus *bus);

#ifdef __cplusplus
}
#endif

#endif
