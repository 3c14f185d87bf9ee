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
 *   feeder_start(&machine, 0);              time is 0 when the loop starts
 *   fsm_posix_stop_on(&host, SIGINT);
 *   fsm_posix_periodic(&host, step, &machine);
 *   fsm_posix_print(&host, stdout);
 *
 * Nothing is allocated. Other threads and signal handlers post by a mailbox (fsm_mailbox.h). */
#ifndef FSM_POSIX_H
#define FSM_POSIX_H

#include "fsm_shared.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Buckets of the histogram: 16 per power of two, so that the relative width is at most 1/16. */
#define FSM_POSIX_BUCKETS 464

#define FSM_POSIX_LAST 16 /* number of stored overruns */

/* Run all machines until `now`, in ticks since the loop started, modulo 2^32. */
typedef void (*fsm_posix_step)(void *context, uint32_t now);

/* Store the first deadline of all machines; return false if no timer is armed. */
typedef bool (*fsm_posix_next)(const void *context, uint32_t *deadline);

/* The reason why a cycle ended after the next deadline. */
typedef enum {
    FSM_POSIX_WOKEN_LATE, /* the step alone would have been in time */
    FSM_POSIX_STEP_LONG,  /* it computed, or waited for something, for longer than a period */
    FSM_POSIX_PREEMPTED,  /* another thread had the processor during the step */
    FSM_POSIX_PAGE_FAULT, /* pages of memory that the step used were not there */
    FSM_POSIX_REASONS
} fsm_posix_reason;

typedef struct {
    uint64_t cycle;   /* counted from 1 */
    uint64_t late_ns; /* from the deadline to the start of the step */
    uint64_t step_ns;
    uint64_t times;   /* preemptions or page faults within the step; else 0 */
    fsm_posix_reason reason;
} fsm_posix_overrun;

typedef struct {
    /* Set by fsm_posix_init; change them before the loop starts. */
    uint64_t period_ns; /* of the periodic loop: a tick, unless you change it */
    uint32_t tick_us;   /* of the machines: X_TICK_US */
    int priority;       /* of SCHED_FIFO; 0: leave the scheduling as it is */
    int cpu;            /* the only processor that runs the loop (Linux); -1: any */
    bool lock_memory;   /* no page is ever fetched from disk while the loop runs */
    size_t stack_bytes; /* with lock_memory: stack that is mapped before the loop starts */
    bool is_explained;  /* each overrun gets its reason, at the price of a system call a cycle;
                         * without it, and where there is no RUSAGE_THREAD, by time stamps alone */

    /* The errno of a failed request; 0 if granted or not requested. */
    int priority_error;
    int cpu_error;
    int memory_error;

    /* Counted by the loop. */
    uint64_t cycles;
    uint64_t overruns; /* cycles that ended after the next deadline */
    uint64_t missed;   /* deadlines without a cycle, because of an overrun */
    uint64_t longest_step_ns;
    uint64_t worst_jitter_ns;
    uint64_t jitter[FSM_POSIX_BUCKETS]; /* wake-ups by their lateness: fsm_posix_bucket_ns */
    uint64_t reasons[FSM_POSIX_REASONS];
    fsm_posix_overrun last[FSM_POSIX_LAST]; /* overrun n, from 0, is at n % FSM_POSIX_LAST */

    /* Internal. */
    uint64_t origin_ns;
    bool is_locked;
    fsm_shared stop;
    int wake[2]; /* a pipe: the reading end, the writing end */
} fsm_posix;

/* Initialize a host; return 0, or the errno of creating its pipe. */
int fsm_posix_init(fsm_posix *host, uint32_t tick_us);

/* Close the pipe. */
void fsm_posix_close(fsm_posix *host);

/* Lock the memory of the process and map the stack of the caller, if `lock_memory` is set. The loop
 * does so automatically. Call this first if the program starts threads before the loop, because
 * locking includes the whole stack of every existing thread, often 8 MB. */
void fsm_posix_lock(fsm_posix *host);

/* Call `step` at each multiple of the period, with that time, until fsm_posix_stop. Deadlines are
 * absolute, so delays do not accumulate. After an overrun the loop continues at the next multiple in
 * the future, and counts the missed ones. Return 0, or an errno of the clock. */
int fsm_posix_periodic(fsm_posix *host, fsm_posix_step step, void *context);

/* Call `step` at the first deadline and after fsm_posix_wake, until fsm_posix_stop; sleep in between.
 * For machines whose inputs enable no transitions. Jitter is that of timers. */
int fsm_posix_tickless(fsm_posix *host, fsm_posix_step step, fsm_posix_next next, void *context);

/* From any thread or signal handler: let the loop call `step` soon, or end it. */
void fsm_posix_wake(fsm_posix *host);
void fsm_posix_stop(fsm_posix *host);

/* End the loop at a signal; one host per process. Return 0 or an errno. */
int fsm_posix_stop_on(fsm_posix *host, int signal_number);

/* Return "woken late", "step long", "preempted" or "page fault". */
const char *fsm_posix_reason_name(fsm_posix_reason reason);

/* Return the minimum lateness of a bucket, in ns; its end is the minimum of the next one. */
uint64_t fsm_posix_bucket_ns(unsigned bucket);

/* Return the lateness in ns that `permyriad` of 10,000 wake-ups did not exceed, as the upper bound of
 * its bucket; 5000 is the median. 0 before the first wake-up. */
uint64_t fsm_posix_jitter_ns(const fsm_posix *host, unsigned permyriad);

/* Print the granted settings, the counters and the histogram, as text, or as one JSON object for
 * `fsmkit latency`. */
void fsm_posix_print(const fsm_posix *host, FILE *to);
void fsm_posix_print_json(const fsm_posix *host, FILE *to);

#ifdef __cplusplus
}
#endif

#endif
