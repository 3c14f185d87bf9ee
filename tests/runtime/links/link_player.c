/* link_player.c: a node of the system of conftest.py that does what is said on standard input.
 *
 *   f HEX            bytes arrive
 *   s N              the host posts `serve(N)` to west or east
 *   c                a cycle; time goes on by a tick
 *   o                print the frames that wait to be sent, in hex (without a transport)
 *   x SEED LOSS DUPLICATION DELAY CYCLES     seeded faults from now on, chances in 1/65536
 *   d 0|1            the link is cut, or no more
 *   l [MS]           wait for listeners
 *   k                print the session in which the peer listens, and the connections ended
 *   v HEX            bytes arrive; print what is counted
 *   w PEER SESSION FRAMES    wait for frames
 *   p                print all that is counted, and data of the machines
 *   z MS             sleep
 *   q                close; print the milliseconds that it took
 *
 * Arguments: the session; then, for ZeroMQ: threaded or deterministic, the endpoints of a and b, and
 * for CURVE the public keys of a and b and this node's file with its secret key. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_link_local.h"
#ifdef WITH_ZMQ
#include "fsm_link_zmq.h"
#include <zmq.h>
#endif
#ifdef NODE_A
#include "talk_a.h"
#define NODE talk_a
#define CALL(name) talk_a_##name
#else
#include "talk_b.h"
#define NODE talk_b
#define CALL(name) talk_b_##name
#endif

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static fsm_link wire;
static fsm_link_faults faults;
static NODE node;
static uint32_t now;
#ifdef WITH_ZMQ
static fsm_link_zmq carrier;
#endif

#ifdef NODE_A
void west_push(west *m, uint8_t how)
{
    (void)m;
    printf("push %d\n", how);
}

void talk_a_west_hit(talk_a *s, uint16_t n, bool last)
{
    (void)s;
    printf("world hears hit %d %d\n", n, last);
}

static void serve(unsigned n)
{
    (void)west_post_serve(&node.west, (uint8_t)n);
}

static void print_node(void)
{
    printf("west got %d mood %d\n", node.west.data.got, node.west.in.mood);
}
#else
static void serve(unsigned n)
{
    (void)east_post_serve(&node.east, (uint8_t)n);
}

static void print_node(void)
{
    printf("east got %d n %" PRIu32 " least %d level %a sum %a speed %" PRId32 " lit %d\n",
           node.east.data.got, node.east.data.n, node.east.data.least, node.east.data.level, node.east.data.sum,
           node.east.in.speed, node.judge.in.lit);
}
#endif

static void arrive(const char *hex)
{
    size_t length = strlen(hex) / 2u;
    uint8_t *exact = malloc(length > 0u ? length : 1u); /* no longer, so that a sanitizer sees */
    if (exact == NULL)
        abort();
    for (size_t i = 0u; i < length; i++) {
        unsigned byte = 0u;
        (void)sscanf(hex + 2u * i, "%2x", &byte);
        exact[i] = (uint8_t)byte;
    }
    (void)fsm_link_arrive(&wire, (uint8_t)(1u - wire.map->node), exact, length);
    free(exact);
}

static void print_frames(void)
{
    fsm_link_frame frame;
    while (fsm_link_next(&wire, &frame)) {
        for (unsigned i = 0u; i < frame.length; i++)
            printf("%02x", frame.bytes[i]);
        printf("\n");
    }
    printf(".\n");
}

static void print_all(void)
{
    for (uint8_t peer = 0u; peer < wire.map->nodes; peer++) {
        if (peer == wire.map->node)
            continue;
        printf("%s session %" PRIu32, wire.map->names[peer], fsm_link_session(&wire, peer));
        for (int what = 0; what < FSM_LINK_COUNTS; what++)
            printf(" %" PRIu32, fsm_link_count(&wire, peer, (fsm_link_counter)what));
        printf(" silence %" PRIu32 "\n", fsm_link_silence(&wire, peer));
    }
    printf("totals");
    for (int what = 0; what < FSM_LINK_TOTALS; what++)
        printf(" %" PRIu32, fsm_link_counted(&wire, (fsm_link_total)what));
    printf(" lost %d faults %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", node.lost, faults.lost,
           faults.duplicated, faults.delayed);
    print_node();
    printf(".\n");
}

static void print_counted(void)
{
    const uint8_t peer = (uint8_t)(1u - wire.map->node);
    printf("%" PRIu32, fsm_link_session(&wire, peer));
    for (int what = 0; what < FSM_LINK_COUNTS; what++)
        printf(" %" PRIu32, fsm_link_count(&wire, peer, (fsm_link_counter)what));
    printf(" %" PRIu32 " %" PRIu32 "\n", fsm_link_counted(&wire, FSM_LINK_MALFORMED),
           fsm_link_counted(&wire, FSM_LINK_FOREIGN));
}

static void print_known(void)
{
#ifdef WITH_ZMQ
    const uint8_t peer = (uint8_t)(1u - wire.map->node);
    printf("%" PRIu32 " %" PRIu32 "\n", fsm_link_zmq_listener(&carrier, peer),
           fsm_link_zmq_dropped(&carrier));
#else
    printf("0 0\n");
#endif
}

static void say(fsm_link_waited waited)
{
    static const char *const words[] = {"ready", "timeout", "beyond", "deaf"};
    char why[128];
    fsm_link_explain(&wire, why, sizeof why);
    printf("%s: %s\n", words[waited], why);
}

static void obey(const char *line)
{
    unsigned a = 0u, b = 0u, c = 0u;
    unsigned long long seed = 0u;
    struct timespec pause;
    switch (line[0]) {
    case 'f':
        arrive(line + 2);
        break;
    case 's':
        (void)sscanf(line + 1, "%u", &a);
        serve(a);
        break;
    case 'c':
        (void)CALL(cycle)(&node, ++now);
        break;
    case 'o':
        print_frames();
        break;
    case 'x':
        (void)sscanf(line + 1, "%llu %" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32, &seed,
                     &faults.loss, &faults.duplication, &faults.delay, &faults.delay_cycles);
        faults.seed = seed;
        fsm_link_set_faults(&wire, &faults);
        break;
    case 'd':
        fsm_link_cut(&faults, line[2] == '1');
        break;
    case 'v':
        arrive(line + 2);
        print_counted();
        break;
    case 'k':
        print_known();
        break;
    case 'l':
        a = 5000u;
        (void)sscanf(line + 1, "%u", &a);
        say(fsm_link_connect(&wire, a));
        break;
    case 'w':
        (void)sscanf(line + 1, "%u %u %u", &a, &b, &c);
        say(fsm_link_await(&wire, (uint8_t)a, b, c, 1000u));
        break;
    case 'p':
        print_all();
        break;
    case 'z':
        (void)sscanf(line + 1, "%u", &a);
        pause.tv_sec = a / 1000u;
        pause.tv_nsec = (long)(a % 1000u) * 1000000L;
        (void)nanosleep(&pause, NULL);
        break;
    default:
        break;
    }
}

int main(int argc, char **argv)
{
    static char line[1 << 18];
    fsm_link_init(&wire, &CALL(map), argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 1u);
#ifdef WITH_ZMQ
    fsm_link_zmq_options options = {0};
    char secret[FSM_LINK_KEY];
    const char *endpoints[2];
    if (argc > 4) {
        endpoints[0] = argv[3];
        endpoints[1] = argv[4];
        options.endpoints = endpoints;
        options.is_deterministic = argv[2][0] == 'd';
        if (argc > 7) {
            options.public_keys = (const char *const *)argv + 5;
            options.secret_key = secret;
            if (!fsm_link_zmq_key(argv[7], "secret-key", secret))
                return 2;
        }
        int error = fsm_link_zmq_open(&carrier, &wire, &options);
        if (error != 0) {
            printf("%s: %s\n", carrier.failed, zmq_strerror(error));
            return 1;
        }
    }
#endif
    CALL(init)(&node);
    node.link = &wire;
    (void)CALL(start)(&node, 0u);
    while (fgets(line, sizeof line, stdin) != NULL && line[0] != 'q') {
        line[strcspn(line, "\n")] = '\0';
        obey(line);
        (void)fflush(stdout);
    }
#ifdef WITH_ZMQ
    if (argc > 4) {
        struct timespec began, ended;
        (void)clock_gettime(CLOCK_MONOTONIC, &began);
        fsm_link_zmq_close(&carrier);
        (void)clock_gettime(CLOCK_MONOTONIC, &ended);
        if (line[0] == 'q')
            printf("%ld\n", (ended.tv_sec - began.tv_sec) * 1000 +
                                (ended.tv_nsec - began.tv_nsec) / 1000000);
    }
#endif
    return 0;
}
