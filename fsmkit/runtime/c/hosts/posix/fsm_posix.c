/* fsm_posix.c: see fsm_posix.h. C99 and POSIX.1-2008.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L
#endif

#include "fsm_posix.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

enum { SECOND = 1000000000, STACK_BYTES = 64 * 1024 };
#define LONGEST_WAIT_NS (UINT64_C(86400) * SECOND) /* POSIX promises no more than 31 days */

static fsm_posix *volatile on_signal;

static uint64_t clock_ns(void)
{
    struct timespec at = {0, 0};
    (void)clock_gettime(CLOCK_MONOTONIC, &at);
    return (uint64_t)at.tv_sec * SECOND + (uint64_t)at.tv_nsec;
}

static struct timespec timespec_of(uint64_t ns)
{
    struct timespec at;
    at.tv_sec = (time_t)(ns / SECOND);
    at.tv_nsec = (long)(ns % SECOND);
    return at;
}

static uint64_t ticks_at(const fsm_posix *host, uint64_t ns)
{
    return (ns - host->origin_ns) / (host->tick_us * UINT64_C(1000));
}

static bool stopped(const fsm_posix *host)
{
    return fsm_shared_read(&host->stop) != 0u;
}

static void note_jitter(fsm_posix *host, uint64_t late_ns)
{
    unsigned bucket = 0;
    while (bucket < FSM_POSIX_BUCKETS - 1 && late_ns >> bucket > 1u)
        bucket++;
    host->jitter[bucket]++;
    if (late_ns > host->worst_jitter_ns)
        host->worst_jitter_ns = late_ns;
}

/* Run the machines; returns when they were done. */
static uint64_t timed_step(fsm_posix *host, fsm_posix_step step, void *context, uint64_t ticks)
{
    uint64_t began = clock_ns();
    uint64_t ended;
    step(context, (uint32_t)ticks);
    ended = clock_ns();
    host->cycles++;
    if (ended - began > host->longest_step_ns)
        host->longest_step_ns = ended - began;
    return ended;
}

/* Have the pages of the stack at hand before the loop needs them. */
static void touch_stack(void)
{
    volatile unsigned char page[STACK_BYTES];
    for (size_t i = 0; i < sizeof page; i += 1024u)
        page[i] = 0;
}

static void prepare(fsm_posix *host)
{
    host->priority_error = 0;
    host->memory_error = 0;
    if (host->priority > 0) {
        struct sched_param wish;
        memset(&wish, 0, sizeof wish);
        wish.sched_priority = host->priority;
        host->priority_error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wish);
    }
    if (host->lock_memory) {
        if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
            host->memory_error = errno;
        touch_stack();
    }
    host->origin_ns = clock_ns();
}

int fsm_posix_init(fsm_posix *host, uint32_t tick_us)
{
    memset(host, 0, sizeof *host);
    host->tick_us = tick_us;
    host->period_ns = tick_us * UINT64_C(1000);
    host->wake[0] = host->wake[1] = -1;
    if (pipe(host->wake) != 0)
        return errno;
    for (int i = 0; i < 2; i++) {
        int flags = fcntl(host->wake[i], F_GETFL);
        if (host->wake[i] >= FD_SETSIZE || flags == -1 ||
            fcntl(host->wake[i], F_SETFL, flags | O_NONBLOCK) == -1 ||
            fcntl(host->wake[i], F_SETFD, FD_CLOEXEC) == -1) {
            int error = host->wake[i] >= FD_SETSIZE ? EMFILE : errno;
            fsm_posix_close(host);
            return error;
        }
    }
    return 0;
}

void fsm_posix_close(fsm_posix *host)
{
    for (int i = 0; i < 2; i++) {
        if (host->wake[i] != -1)
            (void)close(host->wake[i]);
        host->wake[i] = -1;
    }
}

int fsm_posix_periodic(fsm_posix *host, fsm_posix_step step, void *context)
{
    uint64_t deadline;
    prepare(host);
    deadline = host->origin_ns + host->period_ns;
    while (!stopped(host)) {
        struct timespec at = timespec_of(deadline);
        uint64_t ended;
        int error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
        if (error == EINTR)
            continue; /* a signal: perhaps the one to stop */
        if (error != 0)
            return error;
        note_jitter(host, clock_ns() - deadline);
        ended = timed_step(host, step, context, ticks_at(host, deadline));
        if (ended > deadline + host->period_ns) {
            uint64_t missed = (ended - deadline - 1u) / host->period_ns;
            host->overruns++;
            host->missed += missed;
            deadline += missed * host->period_ns;
        }
        deadline += host->period_ns;
    }
    return 0;
}

/* Sleep until a time, a wake, or a day is over; returns 0 or an errno. */
static int await(fsm_posix *host, uint64_t until_ns)
{
    char woken[64];
    fd_set readable;
    uint64_t now = clock_ns();
    uint64_t left = until_ns > now ? until_ns - now : 0u;
    struct timespec wait = timespec_of(left < LONGEST_WAIT_NS ? left : LONGEST_WAIT_NS);
    FD_ZERO(&readable);
    FD_SET(host->wake[0], &readable);
    if (pselect(host->wake[0] + 1, &readable, NULL, NULL, &wait, NULL) < 0)
        return errno == EINTR ? 0 : errno;
    while (read(host->wake[0], woken, sizeof woken) > 0) {
    }
    return 0;
}

int fsm_posix_tickless(fsm_posix *host, fsm_posix_step step, fsm_posix_next next, void *context)
{
    uint64_t due_ns = UINT64_MAX; /* no timer is armed */
    prepare(host);
    while (!stopped(host)) {
        uint64_t now_ns = clock_ns();
        uint64_t ticks = ticks_at(host, now_ns);
        uint32_t deadline;
        int error;
        if (now_ns >= due_ns)
            note_jitter(host, now_ns - due_ns);
        (void)timed_step(host, step, context, ticks);
        due_ns = UINT64_MAX;
        if (next(context, &deadline)) {
            uint32_t ahead = deadline - (uint32_t)ticks;
            if (ahead >= UINT32_C(0x80000000))
                ahead = 0; /* already past */
            due_ns = host->origin_ns + (ticks + ahead) * host->tick_us * UINT64_C(1000);
        }
        error = await(host, due_ns);
        if (error != 0)
            return error;
    }
    return 0;
}

void fsm_posix_wake(fsm_posix *host)
{
    int before = errno;
    ssize_t written = write(host->wake[1], "", 1); /* a full pipe wakes as well */
    (void)written;
    errno = before;
}

void fsm_posix_stop(fsm_posix *host)
{
    fsm_shared_write(&host->stop, 1u);
    fsm_posix_wake(host);
}

static void stop_by_signal(int signal_number)
{
    (void)signal_number;
    fsm_posix_stop(on_signal);
}

int fsm_posix_stop_on(fsm_posix *host, int signal_number)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = stop_by_signal;
    (void)sigemptyset(&action.sa_mask);
    on_signal = host;
    return sigaction(signal_number, &action, NULL) == 0 ? 0 : errno;
}

static void print_wish(FILE *to, const char *what, bool asked, int error)
{
    fprintf(to, "%s: %s%s\n", what, !asked ? "not asked for" : error == 0 ? "granted" : "refused: ",
            asked && error != 0 ? strerror(error) : "");
}

void fsm_posix_print(const fsm_posix *host, FILE *to)
{
    print_wish(to, "real-time priority", host->priority > 0, host->priority_error);
    print_wish(to, "locked memory", host->lock_memory, host->memory_error);
    fprintf(to, "cycles %" PRIu64 ", overruns %" PRIu64 ", missed deadlines %" PRIu64 "\n",
            host->cycles, host->overruns, host->missed);
    fprintf(to, "longest step %" PRIu64 " ns, worst jitter %" PRIu64 " ns\n",
            host->longest_step_ns, host->worst_jitter_ns);
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k++)
        if (host->jitter[k] != 0u)
            fprintf(to, "late by %10" PRIu64 " ns or more: %" PRIu64 "\n",
                    k == 0u ? UINT64_C(0) : UINT64_C(1) << k, host->jitter[k]);
}
