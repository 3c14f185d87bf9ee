/* fsm_posix.c: see fsm_posix.h. C99 and POSIX.1-2008.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#if defined(__linux__) && !defined(_GNU_SOURCE)
#define _GNU_SOURCE /* RUSAGE_THREAD, pthread_setaffinity_np */
#endif
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
#include <sys/resource.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

enum {
    SECOND = 1000000000,
    STACK_BYTES = 64 * 1024,
    FRAME_BYTES = 4096,
    PER_OCTAVE = 16, /* buckets */
    FAULT_NS = 500   /* a fault that only maps a page takes about so long */
};
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

/* ---- the histogram ------------------------------------------------------------------------------ */

static unsigned bucket_of(uint64_t ns)
{
    unsigned octave = 0;
    unsigned bucket;
    if (ns < PER_OCTAVE) {
        return (unsigned)ns;
    }
    while (ns >> octave >= 2 * PER_OCTAVE) {
        octave++;
    }
    bucket = PER_OCTAVE * octave + (unsigned)(ns >> octave);
    return bucket < FSM_POSIX_BUCKETS ? bucket : FSM_POSIX_BUCKETS - 1;
}

uint64_t fsm_posix_bucket_ns(unsigned bucket)
{
    const unsigned octave = bucket < 2 * PER_OCTAVE ? 0 : bucket / PER_OCTAVE - 1;
    return (uint64_t)(bucket - PER_OCTAVE * octave) << octave;
}

uint64_t fsm_posix_jitter_ns(const fsm_posix *host, unsigned permyriad)
{
    uint64_t all = 0;
    uint64_t so_far = 0;
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k++) {
        all += host->jitter[k];
    }
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k++) {
        so_far += host->jitter[k];
        if (so_far != 0 && so_far * 10000u >= all * permyriad) {
            const uint64_t most = fsm_posix_bucket_ns(k + 1) - 1;
            return most < host->worst_jitter_ns ? most : host->worst_jitter_ns;
        }
    }
    return 0;
}

static void note_jitter(fsm_posix *host, uint64_t late_ns)
{
    host->jitter[bucket_of(late_ns)]++;
    if (late_ns > host->worst_jitter_ns) {
        host->worst_jitter_ns = late_ns;
    }
}

/* ---- a step, and why it took too long ------------------------------------------------------------- */

typedef struct {
    uint64_t preemptions, faults, fetches; /* fetches: faults that waited for a disk */
} usage;

/* Return the usage of this thread; all 0 if the system does not count them. */
static usage usage_now(const fsm_posix *host)
{
    usage now = {0, 0, 0};
#ifdef RUSAGE_THREAD
    struct rusage used;
    if (host->is_explained && getrusage(RUSAGE_THREAD, &used) == 0) {
        now.preemptions = (uint64_t)used.ru_nivcsw;
        now.faults = (uint64_t)used.ru_minflt + (uint64_t)used.ru_majflt;
        now.fetches = (uint64_t)used.ru_majflt;
    }
#endif
    (void)host;
    return now;
}

typedef struct {
    uint64_t began, ended;
    usage before;
} timed;

/* Run the machines. */
static timed timed_step(fsm_posix *host, fsm_posix_step step, void *context, uint64_t ticks)
{
    timed it;
    it.before = usage_now(host);
    it.began = clock_ns();
    step(context, (uint32_t)ticks);
    it.ended = clock_ns();
    host->cycles++;
    if (it.ended - it.began > host->longest_step_ns) {
        host->longest_step_ns = it.ended - it.began;
    }
    return it;
}

/* Faults come before preemptions if they alone explain the time; few faults, of large pages perhaps, only
 * if nothing else does. */
static fsm_posix_reason reason_of(const fsm_posix *host, uint64_t step_ns, const usage *within)
{
    if (step_ns <= host->period_ns) {
        return FSM_POSIX_WOKEN_LATE;
    }
    if (within->fetches != 0u || within->faults * FAULT_NS >= step_ns / 2) {
        return FSM_POSIX_PAGE_FAULT;
    }
    if (within->preemptions != 0u) {
        return FSM_POSIX_PREEMPTED;
    }
    return within->faults != 0u ? FSM_POSIX_PAGE_FAULT : FSM_POSIX_STEP_LONG;
}

static void note_overrun(fsm_posix *host, uint64_t deadline, const timed *it)
{
    fsm_posix_overrun *made = &host->last[host->overruns % FSM_POSIX_LAST];
    usage within = usage_now(host);
    within.preemptions -= it->before.preemptions;
    within.faults -= it->before.faults;
    within.fetches -= it->before.fetches;
    made->cycle = host->cycles;
    made->late_ns = it->began - deadline;
    made->step_ns = it->ended - it->began;
    made->reason = reason_of(host, made->step_ns, &within);
    made->times = made->reason == FSM_POSIX_PAGE_FAULT  ? within.faults
                  : made->reason == FSM_POSIX_PREEMPTED ? within.preemptions
                                                        : 0u;
    host->reasons[made->reason]++;
    host->overruns++;
}

/* ---- requests to the system ------------------------------------------------------------ */

/* Map the pages of the stack. Each frame is used after the next one ends, so none can be omitted. */
static unsigned touch_stack(size_t bytes)
{
    volatile unsigned char page[FRAME_BYTES];
    unsigned sum = 0;
    for (size_t i = 0; i < sizeof page; i += 1024u) {
        page[i] = 1;
    }
    if (bytes > sizeof page) {
        sum = touch_stack(bytes - sizeof page);
    }
    return sum + page[0];
}

void fsm_posix_lock(fsm_posix *host)
{
    if (!host->lock_memory || host->is_locked) {
        return;
    }
    host->is_locked = true;
    host->memory_error = mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
    (void)touch_stack(host->stack_bytes);
}

static int run_on(int cpu)
{
#ifdef __linux__
    cpu_set_t only;
    CPU_ZERO(&only);
    if (cpu >= CPU_SETSIZE) {
        return EINVAL;
    }
    CPU_SET((size_t)cpu, &only);
    return pthread_setaffinity_np(pthread_self(), sizeof only, &only);
#else
    (void)cpu;
    return ENOSYS;
#endif
}

static void prepare(fsm_posix *host)
{
    fsm_posix_lock(host);
    host->cpu_error = host->cpu >= 0 ? run_on(host->cpu) : 0;
    host->priority_error = 0;
    if (host->priority > 0) {
        struct sched_param wish;
        memset(&wish, 0, sizeof wish);
        wish.sched_priority = host->priority;
        host->priority_error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wish);
    }
    host->origin_ns = clock_ns();
}

int fsm_posix_init(fsm_posix *host, uint32_t tick_us)
{
    memset(host, 0, sizeof *host);
    host->tick_us = tick_us;
    host->period_ns = tick_us * UINT64_C(1000);
    host->cpu = -1;
    host->stack_bytes = STACK_BYTES;
    host->is_explained = true;
    host->wake[0] = host->wake[1] = -1;
    if (pipe(host->wake) != 0) {
        return errno;
    }
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
        if (host->wake[i] != -1) {
            (void)close(host->wake[i]);
        }
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
        timed it;
        int error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
        if (error == EINTR) {
            continue; /* a signal: perhaps the one to stop */
        }
        if (error != 0) {
            return error;
        }
        note_jitter(host, clock_ns() - deadline);
        it = timed_step(host, step, context, ticks_at(host, deadline));
        if (it.ended > deadline + host->period_ns) {
            uint64_t missed = (it.ended - deadline - 1u) / host->period_ns;
            note_overrun(host, deadline, &it);
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
    if (pselect(host->wake[0] + 1, &readable, NULL, NULL, &wait, NULL) < 0) {
        return errno == EINTR ? 0 : errno;
    }
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
        if (now_ns >= due_ns) {
            note_jitter(host, now_ns - due_ns);
        }
        (void)timed_step(host, step, context, ticks);
        due_ns = UINT64_MAX;
        if (next(context, &deadline)) {
            uint32_t ahead = deadline - (uint32_t)ticks;
            if (ahead >= UINT32_C(0x80000000)) {
                ahead = 0; /* already past */
            }
            due_ns = host->origin_ns + (ticks + ahead) * host->tick_us * UINT64_C(1000);
        }
        error = await(host, due_ns);
        if (error != 0) {
            return error;
        }
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

/* ---- the report ----------------------------------------------------------------------------------- */

static const char *const reason_names[FSM_POSIX_REASONS] = {"woken late", "step long", "preempted",
                                                            "page fault"};

const char *fsm_posix_reason_name(fsm_posix_reason reason)
{
    return reason_names[reason];
}

static void print_wish(FILE *to, const char *what, bool asked, int error)
{
    fprintf(to, "%s: %s%s\n", what, !asked ? "not requested" : error == 0 ? "granted" : "denied: ",
            asked && error != 0 ? strerror(error) : "");
}

/* The first overrun that is kept. */
static uint64_t oldest(const fsm_posix *host)
{
    return host->overruns > FSM_POSIX_LAST ? host->overruns - FSM_POSIX_LAST : 0u;
}

static void print_overruns(const fsm_posix *host, FILE *to)
{
    const char *before = "overruns by reason: ";
    if (host->overruns == 0u) {
        return;
    }
    for (int k = 0; k < FSM_POSIX_REASONS; k++) {
        if (host->reasons[k] != 0u) {
            fprintf(to, "%s%s %" PRIu64, before, reason_names[k], host->reasons[k]);
            before = ", ";
        }
    }
    fprintf(to, "\n");
    for (uint64_t n = oldest(host); n < host->overruns; n++) {
        const fsm_posix_overrun *it = &host->last[n % FSM_POSIX_LAST];
        fprintf(to, "cycle %" PRIu64 ": woken %" PRIu64 " ns late, step %" PRIu64 " ns: %s", it->cycle,
                it->late_ns, it->step_ns, reason_names[it->reason]);
        if (it->times != 0u) {
            fprintf(to, ", %" PRIu64 " times", it->times);
        }
        fprintf(to, "\n");
    }
}

void fsm_posix_print(const fsm_posix *host, FILE *to)
{
    print_wish(to, "real-time priority", host->priority > 0, host->priority_error);
    print_wish(to, "locked memory", host->lock_memory, host->memory_error);
    if (host->cpu >= 0) {
        print_wish(to, "processor", true, host->cpu_error);
    }
    fprintf(to, "cycles %" PRIu64 ", overruns %" PRIu64 ", missed deadlines %" PRIu64 "\n",
            host->cycles, host->overruns, host->missed);
    print_overruns(host, to);
    fprintf(to, "longest step %" PRIu64 " ns, worst jitter %" PRIu64 " ns\n",
            host->longest_step_ns, host->worst_jitter_ns);
    fprintf(to, "jitter: p50 %" PRIu64 " ns, p99 %" PRIu64 " ns, p99.9 %" PRIu64 " ns\n",
            fsm_posix_jitter_ns(host, 5000), fsm_posix_jitter_ns(host, 9900),
            fsm_posix_jitter_ns(host, 9990));
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k += PER_OCTAVE) {
        uint64_t count = 0;
        for (unsigned i = k; i < k + PER_OCTAVE; i++) {
            count += host->jitter[i];
        }
        if (count != 0u) {
            fprintf(to, "late by %10" PRIu64 " ns or more: %" PRIu64 "\n", fsm_posix_bucket_ns(k),
                    count);
        }
    }
}

static void print_json_wish(FILE *to, const char *key, int wanted, int error)
{
    fprintf(to, "\"%s\": {\"wanted\": %d, \"error\": %d}, ", key, wanted, error);
}

void fsm_posix_print_json(const fsm_posix *host, FILE *to)
{
    const char *before = "";
    fprintf(to, "{\"kind\": \"fsm_posix\", \"period_ns\": %" PRIu64 ", ", host->period_ns);
    print_json_wish(to, "priority", host->priority, host->priority_error);
    print_json_wish(to, "locked_memory", host->lock_memory, host->memory_error);
    print_json_wish(to, "cpu", host->cpu, host->cpu_error);
    fprintf(to,
            "\"cycles\": %" PRIu64 ", \"overruns\": %" PRIu64 ", \"missed\": %" PRIu64
            ", \"longest_step_ns\": %" PRIu64 ", \"worst_jitter_ns\": %" PRIu64 ", \"reasons\": {",
            host->cycles, host->overruns, host->missed, host->longest_step_ns,
            host->worst_jitter_ns);
    for (int k = 0; k < FSM_POSIX_REASONS; k++) {
        fprintf(to, "%s\"%s\": %" PRIu64, k == 0 ? "" : ", ", reason_names[k], host->reasons[k]);
    }
    fprintf(to, "}, \"last_overruns\": [");
    for (uint64_t n = oldest(host); n < host->overruns; n++) {
        const fsm_posix_overrun *it = &host->last[n % FSM_POSIX_LAST];
        fprintf(to,
                "%s{\"cycle\": %" PRIu64 ", \"late_ns\": %" PRIu64 ", \"step_ns\": %" PRIu64
                ", \"reason\": \"%s\", \"times\": %" PRIu64 "}",
                before, it->cycle, it->late_ns, it->step_ns, reason_names[it->reason], it->times);
        before = ", ";
    }
    before = "";
    fprintf(to, "], \"jitter_ns\": [");
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k++) {
        if (host->jitter[k] != 0u) {
            fprintf(to, "%s[%" PRIu64 ", %" PRIu64 ", %" PRIu64 "]", before, fsm_posix_bucket_ns(k),
                    fsm_posix_bucket_ns(k + 1), host->jitter[k]);
            before = ", ";
        }
    }
    fprintf(to, "]}\n");
}
