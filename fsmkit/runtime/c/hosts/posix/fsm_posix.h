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
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of the histogram: 16 to each power of two, so that a bucket is at most 1/16 wide. */
#define FSM_POSIX_BUCKETS 464

#define FSM_POSIX_LAST 16 /* overruns that are kept */

/* Run all machines until `now`, in ticks since the loop began, modulo 2^32. */
typedef void (*fsm_posix_step)(void *context, uint32_t now);

/* When the first timer of all machines is due; false if none is armed. */
typedef bool (*fsm_posix_next)(const void *context, uint32_t *deadline);

/* Why a cycle ended after the next deadline. */
typedef enum {
    FSM_POSIX_WOKEN_LATE, /* the step alone would have been in time */
    FSM_POSIX_STEP_LONG,  /* it computed, or waited for something, for longer than a period */
    FSM_POSIX_PREEMPTED,  /* another thread had the processor during the step */
    FSM_POSIX_PAGE_FAULT, /* pages of memory that the step used were not there */
    FSM_POSIX_REASONS
} fsm_posix_reason;

typedef struct {
    uint64_t cycle;   /* counted from 1 */
    uint64_t late_ns; /* from the deadline to the beginning of the step */
    uint64_t step_ns;
    uint64_t times;   /* preemptions or page faults within the step; else 0 */
    fsm_posix_reason reason;
} fsm_posix_overrun;

typedef struct {
    /* Set by fsm_posix_init; change them before the loop begins. */
    uint64_t period_ns; /* of the periodic loop: a tick, unless you change it */
    uint32_t tick_us;   /* of the machines: X_TICK_US */
    int priority;       /* of SCHED_FIFO; 0: leave the scheduling as it is */
    int cpu;            /* the only processor that runs the loop (Linux); -1: any */
    bool lock_memory;   /* no page is ever fetched from disk while the loop runs */
    size_t stack_bytes; /* with lock_memory: stack that is mapped before the loop begins */
    bool is_explained;  /* each overrun gets its reason, at the price of a system call a cycle;
                         * without it, and where there is no RUSAGE_THREAD, by time stamps alone */

    /* Why it was not granted, an errno; 0 if it was, or was not asked for. */
    int priority_error;
    int cpu_error;
    int memory_error;

    /* Counted by the loop. */
    uint64_t cycles;
    uint64_t overruns; /* cycles that ended after the next deadline */
    uint64_t missed;   /* deadlines at which no cycle began, as an overrun reached beyond them */
    uint64_t longest_step_ns;
    uint64_t worst_jitter_ns;
    uint64_t jitter[FSM_POSIX_BUCKETS]; /* wake-ups by their lateness: fsm_posix_bucket_ns */
    uint64_t reasons[FSM_POSIX_REASONS];
    fsm_posix_overrun last[FSM_POSIX_LAST]; /* overrun n, from 0, is at n % FSM_POSIX_LAST */

    /* The loop's own. */
    uint64_t origin_ns;
    bool is_locked;
    fsm_shared stop;
    int wake[2]; /* a pipe: what is read, what is written */
} fsm_posix;

/* Make a host; returns 0, or the errno that left it without a pipe. */
int fsm_posix_init(fsm_posix *host, uint32_t tick_us);

/* Give back the pipe. */
void fsm_posix_close(fsm_posix *host);

/* Lock the memory of the process and map the stack of the caller, if `lock_memory` is set. The loop does
 * so by itself; call this first where the program starts threads before the loop, since a thread
 * that exists by then has all of its stack locked, often 8 MB. */
void fsm_posix_lock(fsm_posix *host);

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

/* "woken late", "step long", "preempted", "page fault". */
const char *fsm_posix_reason_name(fsm_posix_reason reason);

/* The least lateness of a bucket, in ns; that of the next one is the first beyond it. */
uint64_t fsm_posix_bucket_ns(unsigned bucket);

/* The lateness that `permyriad` of 10,000 wake-ups did not exceed, in ns, as the upper bound of its
 * bucket; 5000 is the median. 0 before the first wake-up. */
uint64_t fsm_posix_jitter_ns(const fsm_posix *host, unsigned permyriad);

/* What was granted, what was counted, and the histogram: as text, or as one JSON object, which
 * `fsmkit latency` draws. */
void fsm_posix_print(const fsm_posix *host, FILE *to);
void fsm_posix_print_json(const fsm_posix *host, FILE *to);

#ifdef __cplusplus
}
#endif

#endif
