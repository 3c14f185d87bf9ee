/* board_a.c: feeder belt, feeder, molder, extractor; and the supervisor. board_a.io.yaml has the wires. */
#include "board_a_io.h"

#define BOARD_NAME "a"
#define BOARD_NODE RING_A_NODE_A
#define BOARD_RING(rest) ring_a##rest
#define BOARD_IO(rest) board_a_io##rest
#define BOARD_WIRES BOARD_A_IO_WIRES
#define BOARD_REGISTERS BOARD_A_IO_REGISTERS
#define BOARD_WINDOW BOARD_A_IO_WINDOW
#define BOARD_MODULES(X)                                                                           \
    X(feeder_belt, FEEDER_BELT)                                                                    \
    X(feeder, FEEDER)                                                                              \
    X(molder, MOLDER)                                                                              \
    X(extractor, EXTRACTOR)
#define BOARD_MACHINES(X)                                                                          \
    X(supervisor, SUPERVISOR)                                                                      \
    BOARD_MODULES(X)
#define BOARD_DRIVES(X)                                                                            \
    X(feeder_belt, true)                                                                           \
    X(feeder, false)                                                                               \
    X(molder, false)                                                                               \
    X(extractor, false)

#include "board_program.h"

static uint8_t supervisor_told_fault(void)
{
    return io.node.supervisor.out.fault_code;
}
