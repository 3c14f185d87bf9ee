/* fsm_posix.h: machines in a real-time loop on Linux or another POSIX system.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   static void step(void *context, uint32_t now)   { feeder_run(context, now); }
 *
 *   static fsm_posix host;
 *   fsm_posix_init(&host, FEEDER_TICK_US);
 *   host.priority = 80;                     if the process may
 *   feeder_start(&machine, 0);              time is 0 where the loop begins
 *   fsm_posix_stop_on(&host, SIGINT);
 *   fsm_posix_periodic(&host, step, &machine);
 *   fsm_posix_print(&host, stdout);
 *
 * Nothing is allocated. Other threads and signal handlers post by a mailbox (fsm_mailbox.h). */
#ifndef FSM_POSIX_H
#define FSM_POSIX_H

#include "fsm_shared.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FSM_POSIX_BUCKETS 32

/* Run all machines until `now`, in ticks since the loop began, modulo 2^32. */
typedef void (*fsm_posix_step)(void *context, uint32_t now);

/* When the first timer of all machines is due; false if none is armed. */
typedef bool (*fsm_posix_next)(const void *context, uint32_t *deadline);

typedef struct {
    /* Set by fsm_posix_init; change them before the loop begins. */
    uint64_t period_ns; /* of the periodic loop: a tick, unless you change it */
    uint32_t tick_us;   /* of the machines: X_TICK_US */
    int priority;       /* of SCHED_FIFO; 0: leave the scheduling as it is */
    bool lock_memory;   /* no page is ever fetched from disk while the loop runs */

    /* Why it was not granted, an errno; 0 if it was, or was not asked for. */
    int priority_error;
    int memory_error;

    /* Counted by the loop. */
    uint64_t cycles;
    uint64_t overruns; /* cycles that ended after the next deadline */
    uint64_t missed;   /* deadlines at which no cycle began, as an overrun reached beyond them */
    uint64_t longest_step_ns;
    uint64_t worst_jitter_ns;
    uint64_t jitter[FSM_POSIX_BUCKETS]; /* [k]: wake-ups late by 2^k to 2^(k+1)-1 ns; [0]: 0, too */

    /* The loop's own. */
    uint64_t origin_ns;
    fsm_shared stop;
    int wake[2]; /* a pipe: what is read, what is written */
} fsm_posix;

/* Make a host; returns 0, or the errno that left it without a pipe. */
int fsm_posix_init(fsm_posix *host, uint32_t tick_us);

/* Give back the pipe. */
void fsm_posix_close(fsm_posix *host);

/* Call `step` at each multiple of the period until told to stop, with the time at which it was due.
 * Deadlines are absolute, so nothing adds up. After an overrun the loop goes on at the next
 * multiple that is still ahead, and counts those it missed. Returns 0, or an errno of the clock. */
int fsm_posix_periodic(fsm_posix *host, fsm_posix_step step, void *context);

/* Call `step` when the first timer is due and when someone called fsm_posix_wake, until told to
 * stop; sleep in between. For machines that do not watch inputs. Jitter is that of timers. */
int fsm_posix_tickless(fsm_posix *host, fsm_posix_step step, fsm_posix_next next, void *context);

/* From any thread or signal handler: have `step` called soon, or end the loop. */
void fsm_posix_wake(fsm_posix *host);
void fsm_posix_stop(fsm_posix *host);

/* End the loop when the signal comes; one host in a process. Returns 0 or an errno. */
int fsm_posix_stop_on(fsm_posix *host, int signal_number);

/* What was granted, what was counted, and the histogram. */
void fsm_posix_print(const fsm_posix *host, FILE *to);

#ifdef __cplusplus
}
#endif

#endif
