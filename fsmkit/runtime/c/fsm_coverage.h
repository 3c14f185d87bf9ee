/* The coverage of machines, as bytes that `fsmkit coverage --add` reads. No configuration.
 *
 * The counters of a machine are one area for all machines of its type. They are not guarded: machines
 * that run on several threads may lose a count, and no more. */
#ifndef FSM_COVERAGE_H
#define FSM_COVERAGE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Write bytes to a file or a line. `arg` is the argument that was passed to the caller. */
typedef void (*fsm_write)(void *arg, const uint8_t *bytes, size_t count);

/* Write the counters of one chart: "FSMC", the version 1, the fingerprint, the count of counters in 4
 * bytes, least first, the counters, and their CRC-16/CCITT-FALSE in 2 bytes, most first. */
void fsm_coverage_write(
    const uint8_t fingerprint[8], const uint8_t *counters, uint32_t count, fsm_write write, void *arg);

#ifdef __cplusplus
}
#endif

#endif
