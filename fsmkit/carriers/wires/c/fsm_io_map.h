/* fsm_io_map.h: wires in a window of registers: an FPGA, peripherals, or a file that is shared.
 *
 * Each register is read once, and written once, in a cycle; nothing is allocated or kept. The window is
 * any memory, at an address that is a multiple of 4; fsm_io_map_open makes one of a file (POSIX). */
#ifndef FSM_IO_MAP_H
#define FSM_IO_MAP_H

#include "fsm_io.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    volatile void *base;
    size_t size; /* bytes */
    const fsm_io_wire *wires;
    const fsm_io_register *registers;
    size_t count; /* of registers */
} fsm_io_map;

/* Whether all registers lie within the window; call it before the others. */
bool fsm_io_map_fits(const fsm_io_map *self);

/* Inputs to a raw image; and its outputs to the registers, bits of no wire as 0. */
void fsm_io_map_read(const fsm_io_map *self, void *raw);
void fsm_io_map_write(const fsm_io_map *self, const void *raw);

/* Map `size` bytes of a file (of /dev/mem: from an address of physical memory on) for reading and writing.
 * 0, or errno: EINVAL if a register is beyond it, or the file too short. fsm_io_map_posix.c */
int fsm_io_map_open(fsm_io_map *self, const char *path, uint64_t from);
void fsm_io_map_close(fsm_io_map *self);

#ifdef __cplusplus
}
#endif

#endif
