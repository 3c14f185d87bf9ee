/* posix_overruns.c: a loop whose steps overrun on purpose.
 *
 * Usage: posix_overruns sleep|busy|page|suspend. Ten times, 20 cycles apart: the step sleeps, or computes
 * while a thread of higher priority has its processor, or uses memory that is not mapped; or another
 * process stops this one for a while. */
#define _GNU_SOURCE
#include "posix/fsm_posix.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { TIMES = 10, APART = 20, MEMORY = 64 * 1024 * 1024, PAGE = 4096 };

static fsm_posix host;
static const char *kind;
static fsm_shared is_busy;

static uint64_t now_ns(void)
{
    struct timespec at;
    (void)clock_gettime(CLOCK_MONOTONIC, &at);
    return (uint64_t)at.tv_sec * 1000000000u + (uint64_t)at.tv_nsec;
}

static void spin(uint64_t ns)
{
    const uint64_t until = now_ns() + ns;
    while (now_ns() < until) {
    }
}

static void rest(long ns)
{
    struct timespec wait = {0, 0};
    wait.tv_nsec = ns;
    (void)nanosleep(&wait, NULL);
}

/* Wakes within the step, and takes its processor. */
static void *rival(void *unused)
{
    for (;;) {
        rest(100000);
        if (fsm_shared_read(&is_busy) != 0u) {
            spin(4000000);
            fsm_shared_write(&is_busy, 0u);
        }
    }
    return unused;
}

static void use_memory(void)
{
    unsigned char *memory = mmap(NULL, MEMORY, PROT_READ | PROT_WRITE,
                                 MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED)
        return;
    for (size_t at = 0; at < MEMORY; at += PAGE)
        memory[at] = 1;
    (void)munmap(memory, MEMORY);
}

static void step(void *unused, uint32_t now)
{
    (void)unused;
    if (host.cycles >= TIMES * APART)
        fsm_posix_stop(&host);
    if (host.cycles % APART != APART - 1 || now < 2u)
        return;
    if (strcmp(kind, "sleep") == 0) {
        rest(3000000);
    } else if (strcmp(kind, "busy") == 0) {
        fsm_shared_write(&is_busy, 1u);
        spin(3000000); /* the rival comes, or the host had the processor to itself */
        while (fsm_shared_read(&is_busy) != 0u) {
        }
    } else if (strcmp(kind, "page") == 0) {
        use_memory();
    }
}

/* Stop and continue the parent. */
static void suspend_parent(void)
{
    const pid_t parent = getppid();
    for (int i = 0; i < TIMES; i++) {
        rest(20000000);
        (void)kill(parent, SIGSTOP);
        rest(5000000);
        (void)kill(parent, SIGCONT);
    }
    _exit(0);
}

int main(int argc, char **argv)
{
    pthread_t thread;
    cpu_set_t only;
    pid_t child = -1;
    int error = fsm_posix_init(&host, 1000);
    if (error != 0 || argc < 2 || sched_getaffinity(0, sizeof only, &only) != 0)
        return 2;
    kind = argv[1];
    host.priority = 50;
    for (host.cpu = 0; !CPU_ISSET((size_t)host.cpu, &only); host.cpu++) {
    }
    if (strcmp(kind, "busy") == 0) {
        struct sched_param higher = {0};
        higher.sched_priority = 60;
        CPU_ZERO(&only);
        CPU_SET((size_t)host.cpu, &only);
        if (pthread_create(&thread, NULL, rival, NULL) != 0 ||
            pthread_setaffinity_np(thread, sizeof only, &only) != 0)
            return 2;
        (void)pthread_setschedparam(thread, SCHED_FIFO, &higher); /* without the right, as equals */
    }
    if (strcmp(kind, "suspend") == 0) {
        child = fork();
        if (child == 0)
            suspend_parent();
    }
    error = fsm_posix_periodic(&host, step, NULL);
    if (child > 0)
        (void)waitpid(child, NULL, 0);
    fsm_posix_print(&host, stdout);
    fsm_posix_print_json(&host, stdout);
    fsm_posix_close(&host);
    return error;
}
