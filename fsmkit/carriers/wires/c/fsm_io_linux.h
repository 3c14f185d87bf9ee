/* fsm_io_linux.h: wires of a computer with Linux: GPIO lines, converters (IIO), counters and PWM.
 *
 *   digital_in N, digital_out N   line N of the GPIO chip; its character device, second version of the calls
 *   analog_in N                   IIO/in_voltageN_raw
 *   counter N                     COUNTER/countN/count
 *   pwm N                         PWM/pwmN, exported if it is not; 0 to its full value is 0 to the period
 *
 * All files stay open. Numbers (number_in, number_out) have no device here; a pwm below 0 is 0. Each call is a
 * system call per converter, counter and pwm, and one for all lines of a direction: not for a loop that
 * must make none. Nothing is allocated. */
#ifndef FSM_IO_LINUX_H
#define FSM_IO_LINUX_H

#include "fsm_io.h"

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_IO_LINUX_FILES
#define FSM_IO_LINUX_FILES 32 /* converters, counters and pwm of a board */
#endif
#define FSM_IO_LINUX_LINES 64 /* of each direction, as the kernel has it */

/* Paths of devices; NULL for kinds without a device. */
typedef struct {
    const char *gpio;    /* /dev/gpiochip0 */
    const char *iio;     /* /sys/bus/iio/devices/iio:device0 */
    const char *counter; /* /sys/bus/counter/devices/counter0 */
    const char *pwm;     /* /sys/class/pwm/pwmchip0 */
    uint32_t pwm_period_ns;
} fsm_io_linux_places;

typedef struct {
    int file;
    uint16_t wire;
} fsm_io_linux_file;

typedef struct {
    int file; /* of the requested lines; -1: none */
    uint16_t count;
    uint16_t wires[FSM_IO_LINUX_LINES];
} fsm_io_linux_lines;

typedef struct {
    const fsm_io_wire *wires;
    size_t count;
    int (*ioctl)(int file, unsigned long request, void *argument); /* NULL: that of the system */
    uint32_t period_ns;
    uint32_t errors;    /* wires that could not be read or written; stops at 2^32 - 1 */
    const char *failed; /* the wire that did not open, or NULL */
    fsm_io_linux_lines in, out;
    uint16_t file_count;
    fsm_io_linux_file files[FSM_IO_LINUX_FILES];
} fsm_io_linux;

/* Open all devices of the wires, outputs at what is safe. 0, or errno, and nothing is open: ENOTSUP for a
 * wire that has no device here, ENODEV where its place is NULL, EMFILE for more than there is room for.
 * `wires`, `count` and `ioctl` are set before, all else is 0. */
int fsm_io_linux_open(fsm_io_linux *self, const fsm_io_linux_places *places);

/* Inputs to a raw image, and its outputs to the devices. 0, or errno of the first that failed; the others
 * are done, and an input that failed is as it was. */
int fsm_io_linux_read(fsm_io_linux *self, void *raw);
int fsm_io_linux_write(fsm_io_linux *self, const void *raw);

void fsm_io_linux_close(fsm_io_linux *self);

#ifdef __cplusplus
}
#endif

#endif
