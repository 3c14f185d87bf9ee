#define _POSIX_C_SOURCE 200809L
/* main.c: the program of a board.
 *
 *   board_a --cosim ENDPOINT     a step for each request, time is what the request says: reproducible
 *   board_a --realtime ENDPOINT  a step each millisecond; inputs are taken and outputs told as requests
 *                                come, and the last ones hold in between
 *
 *   --log FILE                   record what comes to the machines
 *   --links A,B                  endpoints of the links, one for each board, in place of the
 *                                deployment's
 *   --map FILE                   the wires are registers in a file that is mapped, such as /dev/mem
 *   --from BYTES                 where they begin in it
 *   --alone                      no links: the other boards are not there
 *   --follow                     the log is written out before each answer, for who reads it meanwhile
 *   --seconds N                  of a real-time run; else until it is told to quit
 *   --priority N                 of SCHED_FIFO for the loop, and locked memory; the threads of the links
 *                                get N + 2, since a frame must not wait for a loop
 *   --cpus 2,3                   the loop runs on the first, the threads of the links on the others
 *
 * Status 0; 2 for a command line or a set-up that does not do, with a line on stderr. */
#include "posix/fsm_notify.h"
#include "recorder.h"
#include "server.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <zmq.h>

enum {
    REQUEST_ROOM = 4096,
    REQUESTS_PER_CYCLE = 4,
    INPUTS_MS = 100,
    STATUS_MS = 1000,
    PATIENCE_MS = 1000,
    ENDPOINT_ROOM = 512,
    HIGHEST_PRIORITY = 99,
    ABOVE_LOOP = 2, /* priority of the links */
    CPUS = 64
};

typedef struct {
    const char *endpoint, *log, *map;
    uint64_t from;
    bool is_real_time, is_alone, is_followed;
    long seconds;
    int priority;
    int cpu;       /* of the loop; -1: any */
    uint64_t cpus; /* of the links, a bit each; 0: any */
    char links[ENDPOINT_ROOM]; /* cut into pieces */
    const char *endpoints[FSM_LINK_NODES];
} arguments;

static server it;
static fsm_posix host;
static fsm_notify notify;
static fsm_io_map map;
static void *context, *replier;
static bool is_followed; /* the log is written out before each answer */
static uint8_t request[REQUEST_ROOM];

/* ---- command line ------------------------------------------------------------------------------ */

static bool read_links(arguments *a, const char *value)
{
    uint8_t nodes = 0;
    if (strlen(value) >= sizeof a->links)
        return false;
    strcpy(a->links, value);
    for (char *at = strtok(a->links, ","); at != NULL; at = strtok(NULL, ",")) {
        if (nodes >= board_this.map->nodes)
            return false;
        a->endpoints[nodes++] = at;
    }
    return nodes == board_this.map->nodes;
}

static bool read_number(const char *value, long *number)
{
    char *end;
    *number = strtol(value, &end, 10);
    return end != value && *end == '\0' && *number >= 0 && *number < 1000000;
}

static bool read_address(const char *value, uint64_t *address)
{
    char *end;
    errno = 0;
    *address = strtoull(value, &end, 0);
    return end != value && *end == '\0' && *value != '-' && errno == 0;
}

static bool read_cpus(arguments *a, const char *value)
{
    for (bool is_first = true; *value != '\0'; is_first = false) {
        char *end;
        const long cpu = strtol(value, &end, 10);
        if (end == value || cpu < 0 || cpu >= CPUS || (*end != ',' && *end != '\0'))
            return false;
        if (is_first)
            a->cpu = (int)cpu;
        else
            a->cpus |= UINT64_C(1) << cpu;
        value = *end == ',' ? end + 1 : end;
    }
    return a->cpu >= 0;
}

static bool read_option(arguments *a, const char *name, const char *value)
{
    long number;
    if (strcmp(name, "--cosim") == 0 || strcmp(name, "--realtime") == 0) {
        a->is_real_time = strcmp(name, "--realtime") == 0;
        a->endpoint = value;
    } else if (strcmp(name, "--log") == 0) {
        a->log = value;
    } else if (strcmp(name, "--map") == 0) {
        a->map = value;
    } else if (strcmp(name, "--from") == 0) {
        return read_address(value, &a->from);
    } else if (strcmp(name, "--links") == 0) {
        return read_links(a, value);
    } else if (strcmp(name, "--seconds") == 0) {
        return read_number(value, &a->seconds);
    } else if (strcmp(name, "--priority") == 0) {
        if (!read_number(value, &number) || number > HIGHEST_PRIORITY)
            return false;
        a->priority = (int)number;
    } else if (strcmp(name, "--cpus") == 0) {
        return read_cpus(a, value);
    } else {
        return false;
    }
    return true;
}

static bool read_arguments(arguments *a, int argc, char **argv)
{
    memset(a, 0, sizeof *a);
    a->cpu = -1;
    for (uint8_t node = 0; node < board_this.map->nodes; node++)
        a->endpoints[node] = board_this.endpoints[node];
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--alone") == 0)
            a->is_alone = true;
        else if (strcmp(argv[i], "--follow") == 0)
            a->is_followed = true;
        else if (i + 1 >= argc || !read_option(a, argv[i], argv[i + 1]))
            return false;
        else
            i++;
    }
    return a->endpoint != NULL;
}

/* ---- set-up ------------------------------------------------------------------------------------- */

/* Greater than that of the run before, as long as the clock is not set back. */
static uint32_t new_session(void)
{
    struct timespec now = {0, 0};
    uint32_t session;
    (void)clock_gettime(CLOCK_REALTIME, &now);
    session = (uint32_t)now.tv_sec * 1000u + (uint32_t)(now.tv_nsec / 1000000);
    return session != 0u ? session : 1u;
}

static bool open_links(const arguments *a)
{
    fsm_link_zmq_options options = {0};
    int error;
    fsm_link_init(&it.link, board_this.map, new_session());
    fsm_link_set_faults(&it.link, &it.faults);
    if (a->is_alone)
        return true;
    options.endpoints = a->endpoints;
    options.is_deterministic = !a->is_real_time;
    if (a->is_real_time && a->priority > 0) {
        const int above = a->priority + ABOVE_LOOP;
        options.send_priority = above < HIGHEST_PRIORITY ? above : HIGHEST_PRIORITY;
        options.receive_priority = options.io_priority = options.send_priority;
    }
    options.cpus = a->is_real_time ? a->cpus : 0u;
    error = fsm_link_zmq_open(&it.zmq, &it.link, &options);
    if (error != 0) {
        fprintf(stderr, "links: %s: %s\n", it.zmq.failed, zmq_strerror(error));
        return false;
    }
    it.is_linked = true;
    if (it.zmq.priority_error != 0)
        fprintf(stderr, "priority of the links: %s\n", strerror(it.zmq.priority_error));
    if (it.zmq.cpus_error != 0)
        fprintf(stderr, "processors of the links: %s\n", strerror(it.zmq.cpus_error));
    return true;
}

static bool open_map(const arguments *a)
{
    int error;
    if (a->map == NULL)
        return true;
    map = (fsm_io_map){NULL, board_this.window, board_this.wires, board_this.registers,
                       board_this.register_count};
    error = fsm_io_map_open(&map, a->map, a->from);
    if (error == 0)
        it.map = &map;
    else
        fprintf(stderr, "%s: %s\n", a->map, strerror(error));
    return error == 0;
}

static bool open_server(const char *endpoint)
{
    const int none = 0;
    context = zmq_ctx_new();
    replier = context != NULL ? zmq_socket(context, ZMQ_REP) : NULL;
    if (replier != NULL && zmq_bind(replier, endpoint) == 0)
        return true;
    fprintf(stderr, "%s: %s\n", endpoint, zmq_strerror(zmq_errno()));
    if (replier != NULL)
        (void)zmq_setsockopt(replier, ZMQ_LINGER, &none, sizeof none);
    return false;
}

static void close_all(void)
{
    fsm_io_map_close(&map);
    if (it.is_linked)
        fsm_link_zmq_close(&it.zmq);
    if (replier != NULL)
        (void)zmq_close(replier);
    if (context != NULL)
        (void)zmq_ctx_term(context);
}

/* ---- loops --------------------------------------------------------------------------------------- */

/* Answer a request; false if there is none, or the socket failed. */
static bool serve(int flags)
{
    const int length = zmq_recv(replier, request, sizeof request, flags);
    if (length < 0)
        return false;
    server_answer(&it, request, (size_t)length <= sizeof request ? (size_t)length : 0u);
    if (is_followed)
        recorder_flush();
    return zmq_send(replier, it.reply, it.length, 0) >= 0;
}

/* Until told to quit, or until whoever began this process is gone. */
static int co_simulate(void)
{
    const pid_t parent = getppid();
    (void)zmq_setsockopt(replier, ZMQ_RCVTIMEO, &(int){PATIENCE_MS}, sizeof(int));
    while (!it.is_over) {
        if (serve(0) || zmq_errno() == EINTR)
            continue;
        if (zmq_errno() == EAGAIN) {
            it.is_over = getppid() != parent;
        } else {
            fprintf(stderr, "requests: %s\n", zmq_strerror(zmq_errno()));
            return 2;
        }
    }
    return 0;
}

/* A board is ready when it has heard the others, whatever its state is. */
static void inform_supervisor(uint32_t now)
{
    char line[BOARD_NOTE_LENGTH + 16], status[2 * FSM_NOTIFY_STATUS];
    bool is_ready = true;
    fsm_notify_beat(&notify);
    if (now % STATUS_MS != 0u)
        return;
    for (uint8_t peer = 0; it.is_linked && peer < board_this.map->nodes; peer++)
        if (peer != board_this.map->node && fsm_link_session(&it.link, peer) == 0u)
            is_ready = false;
    if (is_ready)
        fsm_notify_ready(&notify);
    (void)server_status(&it, line, sizeof line);
    (void)snprintf(status, sizeof status, "%s, %u lost, %lu overruns", line, server_losses(&it),
                   (unsigned long)host.overruns);
    fsm_notify_status(&notify, status);
}

static void cycle(void *unused, uint32_t now)
{
    (void)unused;
    for (int i = 0; i < REQUESTS_PER_CYCLE && serve(ZMQ_DONTWAIT); i++) {
    }
    if (now - it.heard > INPUTS_MS)
        board_off(&it.board, "no inputs for 100 ms");
    server_read_map(&it);
    board_step(&it.board, now);
    server_write_map(&it);
    inform_supervisor(now);
    if (it.is_over)
        fsm_posix_stop(&host);
}

/* Memory is locked before any thread is started. */
static bool open_host(const arguments *a)
{
    const int error = fsm_posix_init(&host, 1000u);
    if (error != 0) {
        fprintf(stderr, "the loop: %s\n", strerror(error));
        return false;
    }
    host.priority = a->priority;
    host.cpu = a->cpu;
    host.lock_memory = a->priority > 0;
    if (a->is_real_time)
        fsm_posix_lock(&host);
    return true;
}

static int run_in_real_time(const arguments *a)
{
    int error = fsm_posix_stop_on(&host, SIGINT);
    if (error == 0)
        error = fsm_posix_stop_on(&host, SIGTERM);
    if (error == 0)
        error = fsm_posix_stop_on(&host, SIGALRM);
    if (error == 0)
        error = fsm_notify_open(&notify);
    if (error == 0) {
        it.host = &host;
        (void)alarm((unsigned)a->seconds); /* 0: never */
        error = fsm_posix_periodic(&host, cycle, NULL);
        fsm_notify_close(&notify);
        fsm_posix_print(&host, stdout);
    }
    if (error != 0)
        fprintf(stderr, "the loop: %s\n", strerror(error));
    return error == 0 ? 0 : 2;
}

int main(int argc, char **argv)
{
    arguments a;
    int status = 2;
    if (!read_arguments(&a, argc, argv)) {
        fprintf(stderr, "usage: %s --cosim|--realtime ENDPOINT [--log FILE] [--map FILE] [--from BYTES] "
                        "[--links A,B] [--alone] [--follow] [--seconds N] [--priority N] [--cpus N,N]\n",
                argv[0]);
        return 2;
    }
    is_followed = a.is_followed;
    if (a.log != NULL && !recorder_open(a.log)) {
        fprintf(stderr, "%s: %s\n", a.log, strerror(errno));
        return 2;
    }
    if (open_host(&a) && open_map(&a) && open_links(&a) && open_server(a.endpoint)) {
        board_make(&it.board, &it.link, it.is_linked);
        status = a.is_real_time ? run_in_real_time(&a) : co_simulate();
    }
    close_all();
    fsm_posix_close(&host);
    if (!recorder_close()) {
        fprintf(stderr, "%s: not all could be written\n", a.log);
        status = 2;
    }
    return status;
}
