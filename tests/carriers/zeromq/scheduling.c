/* scheduling.c: opens a link whose threads have priorities and a processor, and prints what they got.
 *
 * Usage: scheduling PRIORITY CPUS ENDPOINT ENDPOINT. A line of the errors, then one for each thread:
 * its policy, its priority, the processors it may run on. */
#define _GNU_SOURCE
#include "fsm_link_zmq.h"

#include <dirent.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const uint16_t levels[2] = {0u, 0u};
static const char *const names[2] = {"near", "far"};
static const fsm_link_map map = {7u, 0u, 2u, 0u, NULL, levels, names, NULL, 1u, false, 0u};

static fsm_link link_to_others;
static fsm_link_zmq carrier;

int main(int argc, char **argv)
{
    const char *endpoints[2];
    fsm_link_zmq_options options = {0};
    DIR *threads;
    if (argc != 5)
        return 2;
    endpoints[0] = argv[3];
    endpoints[1] = argv[4];
    options.endpoints = endpoints;
    options.send_priority = options.receive_priority = options.io_priority = atoi(argv[1]);
    options.cpus = strtoull(argv[2], NULL, 10);
    fsm_link_init(&link_to_others, &map, 7u);
    if (fsm_link_zmq_open(&carrier, &link_to_others, &options) != 0)
        return 3;
    printf("errors %d %d\n", carrier.priority_error, carrier.cpus_error);
    (void)usleep(50000); /* threads of ZeroMQ schedule themselves */
    threads = opendir("/proc/self/task");
    for (struct dirent *it; threads != NULL && (it = readdir(threads)) != NULL;) {
        const pid_t thread = (pid_t)atoi(it->d_name);
        struct sched_param parameters;
        cpu_set_t cpus;
        if (thread != 0 && thread != getpid() && sched_getparam(thread, &parameters) == 0 &&
            sched_getaffinity(thread, sizeof cpus, &cpus) == 0)
            printf("%d %d %d\n", sched_getscheduler(thread), parameters.sched_priority,
                   CPU_COUNT(&cpus));
    }
    if (threads != NULL)
        (void)closedir(threads);
    fsm_link_zmq_close(&carrier);
    return 0;
}
