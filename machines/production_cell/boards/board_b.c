/* board_b.c: extraction belt, sorter, camera, rotator. board_b.io.yaml has the wires. */
#include "board_b_io.h"

#define BOARD_NAME "b"
#define BOARD_NODE RING_B_NODE_B
#define BOARD_RING(rest) ring_b##rest
#define BOARD_IO(rest) board_b_io##rest
#define BOARD_WIRES BOARD_B_IO_WIRES
#define BOARD_REGISTERS BOARD_B_IO_REGISTERS
#define BOARD_WINDOW BOARD_B_IO_WINDOW
#define BOARD_MODULES(X)                                                                           \
    X(extraction_belt, EXTRACTION_BELT)                                                            \
    X(sorter, SORTER)                                                                              \
    X(camera, CAMERA)                                                                              \
    X(rotator, ROTATOR)
#define BOARD_MACHINES(X) BOARD_MODULES(X)
#define BOARD_DRIVES(X)                                                                            \
    X(extraction_belt, true)                                                                       \
    X(rotator, false)

#include "board_program.h"
