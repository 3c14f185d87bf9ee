/* posix_simulated.c: the POSIX host under a simulated clock.
 *
 * Usage: posix_simulated periodic|tickless < lines. What sleeps reads a line "late step": the host
 * wakes that much too late, in nanoseconds, and its step takes that long; 0 of "signal step" in the
 * place of `late` means that a signal comes first. Two more numbers are preemptions and page faults of
 * the step, a third page faults that waited for a disk. Tickless, a line "wake after step" wakes the
 * host after some time, and each step arms a timer 5 ticks ahead, but the fourth arms none. The
 * loop is stopped at the end of the lines.
 * Linked with --wrap for clock_gettime, clock_nanosleep, getrusage and pselect. */
#define _GNU_SOURCE
#include "posix/fsm_posix.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

static fsm_posix host;
static uint64_t now_ns = UINT64_C(1700000000000000123);
static uint64_t began_ns;
static uint64_t step_ns;
static long of_step[3], in_all[3]; /* preemptions, page faults, of these from disk */
static unsigned steps;
static bool armed;
static uint32_t due;

int __wrap_clock_gettime(clockid_t clock, struct timespec *at);
int __wrap_clock_nanosleep(clockid_t clock, int flags, const struct timespec *at,
                           struct timespec *left);
int __wrap_getrusage(int who, struct rusage *used);
int __wrap_pselect(int count, fd_set *readable, fd_set *writable, fd_set *other,
                   const struct timespec *wait, const sigset_t *mask);

static void wrong(const char *what)
{
    printf("wrong: %s\n", what);
    exit(1);
}

static uint64_t ns_of(const struct timespec *at)
{
    return (uint64_t)at->tv_sec * UINT64_C(1000000000) + (uint64_t)at->tv_nsec;
}

int __wrap_clock_gettime(clockid_t clock, struct timespec *at)
{
    if (clock != CLOCK_MONOTONIC)
        wrong("another clock");
    at->tv_sec = (time_t)(now_ns / UINT64_C(1000000000));
    at->tv_nsec = (long)(now_ns % UINT64_C(1000000000));
    return 0;
}

/* The words of the next line; false at the end, which stops the loop. */
static bool next_line(char *first, uint64_t *a, uint64_t *b)
{
    char line[100];
    *a = *b = 0;
    memset(of_step, 0, sizeof of_step);
    if (fgets(line, sizeof line, stdin) == NULL ||
        sscanf(line, "%19s %" SCNu64 " %" SCNu64, first, a, b) < 2) {
        fsm_posix_stop(&host);
        return false;
    }
    (void)sscanf(line, "%*s %*u %ld %ld %ld", &of_step[0], &of_step[1], &of_step[2]);
    return true;
}

int __wrap_getrusage(int who, struct rusage *used)
{
    if (who != RUSAGE_THREAD)
        wrong("the usage of others");
    memset(used, 0, sizeof *used);
    used->ru_nivcsw = in_all[0];
    used->ru_minflt = in_all[1];
    used->ru_majflt = in_all[2];
    return 0;
}

int __wrap_clock_nanosleep(clockid_t clock, int flags, const struct timespec *at,
                           struct timespec *left)
{
    char first[20];
    uint64_t after, unused;
    (void)left;
    if (clock != CLOCK_MONOTONIC || flags != TIMER_ABSTIME)
        wrong("not an absolute time of the monotonic clock");
    if (!next_line(first, &after, &unused))
        return EINTR;
    if (strcmp(first, "signal") == 0)
        return EINTR;
    if (ns_of(at) > now_ns)
        now_ns = ns_of(at);
    now_ns += strtoull(first, NULL, 10);
    step_ns = after;
    return 0;
}

int __wrap_pselect(int count, fd_set *readable, fd_set *writable, fd_set *other,
                   const struct timespec *wait, const sigset_t *mask)
{
    char first[20];
    uint64_t a, b;
    (void)count;
    if (writable != NULL || other != NULL || mask != NULL || !FD_ISSET(host.wake[0], readable))
        wrong("what is waited for");
    if (!next_line(first, &a, &b))
        return 1;
    if (strcmp(first, "wake") == 0) {
        if (a > ns_of(wait))
            wrong("the timer comes before the wake");
        fsm_posix_wake(&host);
        now_ns += a;
        step_ns = b;
        return 1;
    }
    now_ns += ns_of(wait) + strtoull(first, NULL, 10);
    step_ns = a;
    return 0;
}

static void step(void *context, uint32_t now)
{
    if (context != &host)
        wrong("the context");
    printf("step %" PRIu32 " at %" PRIu64 "\n", now, now_ns - began_ns);
    now_ns += step_ns;
    for (int i = 0; i < 3; i++)
        in_all[i] += of_step[i];
    armed = ++steps != 4;
    due = now + 5u;
}

static bool next(const void *context, uint32_t *deadline)
{
    if (context != &host)
        wrong("the context");
    *deadline = due;
    return armed;
}

int main(int argc, char **argv)
{
    int error = fsm_posix_init(&host, 1000);
    char byte;
    if (error != 0 || argc < 2)
        return 2;
    began_ns = now_ns;
    error = strcmp(argv[1], "periodic") == 0 ? fsm_posix_periodic(&host, step, &host)
                                             : fsm_posix_tickless(&host, step, next, &host);
    (argc > 2 ? fsm_posix_print_json : fsm_posix_print)(&host, stdout);
    printf("bytes left in the pipe: %d\n", (int)read(host.wake[0], &byte, 1));
    fsm_posix_close(&host);
    return error;
}
