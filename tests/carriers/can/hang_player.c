/* hang_player.c: a loop that hangs, on a simulated clock and a simulated bus: when the last and the
 * first frame goes out, of a cyclic message of a foreign node and of the hello of a shared bus.
 *
 * Reads lines `watchdog message_cycle loop_period hang_for` in ms; the loop hangs at 1000. Prints the
 * times of the last completed cycle, and of the last and the next frame of both, and the frames. */
#define fsm_can_bus_open simulated_open
#define fsm_can_bus_send simulated_send
#define fsm_can_bus_receive simulated_receive
#define fsm_can_bus_close simulated_close
#define clock_gettime simulated_clock
#define now_ms can_now_ms
#define count can_count
#define arrive can_arrive
#define hear can_hear
#define BURST can_BURST
#include "fsm_link_can.c"
#undef now_ms
#undef count
#undef arrive
#undef hear
#undef BURST
#include "fsm_link_net.c"

#include <inttypes.h>
#include <stdio.h>

enum { LEVELS_ID = 0x200, HELLO_ID = 0x300, HANG_AT = 1000 };

static uint64_t now;
static uint64_t sent[2][20000]; /* times of the frames of both */
static unsigned sent_count[2];

int simulated_clock(clockid_t clock, struct timespec *to)
{
    (void)clock;
    to->tv_sec = (time_t)(now / 1000u);
    to->tv_nsec = (long)(now % 1000u) * 1000000;
    return 0;
}

int simulated_open(fsm_can_bus *bus, const char *name, const fsm_can_message *wanted, unsigned some)
{
    (void)bus, (void)name, (void)wanted, (void)some;
    return 0;
}

bool simulated_send(const fsm_can_bus *bus, const fsm_can_frame *frame, bool is_fd)
{
    unsigned which = frame->id == HELLO_ID ? 1u : 0u;
    (void)bus, (void)is_fd;
    sent[which][sent_count[which]++] = now;
    return true;
}

bool simulated_receive(const fsm_can_bus *bus, fsm_can_frame *frame)
{
    (void)bus, (void)frame;
    return false;
}

void simulated_close(fsm_can_bus *bus)
{
    (void)bus;
}

static bool anything(uint8_t sender, uint16_t message, const uint8_t *payload)
{
    (void)sender, (void)message, (void)payload;
    return true;
}

static uint64_t last_until(unsigned which, uint64_t end)
{
    uint64_t found = 0u;
    for (unsigned i = 0u; i < sent_count[which] && sent[which][i] < end; i++)
        found = sent[which][i];
    return found;
}

static uint64_t first_from(unsigned which, uint64_t start)
{
    for (unsigned i = 0u; i < sent_count[which]; i++)
        if (sent[which][i] >= start)
            return sent[which][i];
    return 0u;
}

static void play(uint32_t watchdog, uint32_t cycle, uint32_t period, uint32_t hang_for)
{
    static const uint16_t sizes[] = {1u, 0u};
    static const char *const names[] = {"a", "b"};
    static const fsm_can_message hellos[] = {{0u, 0u, 0u, 0u, false, 0u, NULL},
                                             {0u, 0u, 0u, 0u, false, 0u, NULL},
                                             {HELLO_ID, 0u, 0u, 8u, false, 0u, NULL},
                                             {HELLO_ID + 1, 0u, 0u, 8u, false, 0u, NULL}};
    static const fsm_can_net tables = {1u, 2u, 0u, hellos};
    const fsm_link_map map = {1u, 0u,    2u, 0u,       NULL, sizes,
                              names, anything, 1u, false, watchdog};
    const fsm_can_message message = {LEVELS_ID, FSM_LINK_LEVELS, cycle, 1u, false, 0u, NULL};
    const fsm_can_node node = {1u, 0u, NULL, 0u, 1u, 0u, NULL, &message, NULL};
    static fsm_link link;
    static fsm_link_fan fan;
    static fsm_link_can can;
    static fsm_link_net net;
    uint64_t next_cycle = 1u, wake_can = 0u, wake_net = 0u, due = HELLO_MS, completed = 0u;
    uint64_t resume = HANG_AT + hang_for;
    fsm_link_frame frame;
    memset(&can, 0, sizeof can);
    memset(&net, 0, sizeof net);
    memset(&fan, 0, sizeof fan);
    memset(sent_count, 0, sizeof sent_count);
    now = 0u;
    fsm_link_init(&link, &map, 1u);
    fan.link = &link;
    can.fan = &fan;
    can.node = &node;
    net.link = &link;
    net.net = &tables;
    (void)pthread_mutex_init(&can.turn, NULL);
    (void)sem_init(&net.work, 0, 0u);
    fsm_link_watch(&link, &can.watch, now);
    fsm_link_watch(&link, &net.watch, now);
    for (; now < resume + 1000u; now++) {
        if (now == next_cycle) {
            next_cycle += period;
            if (next_cycle > HANG_AT && next_cycle < resume)
                next_cycle = resume;
            fsm_link_begin(&link);
            (void)fsm_link_levels_out(&link);
            fsm_link_end(&link);
            completed = now < resume ? now : completed;
            while (fsm_link_next(&link, &frame)) /* the thread of the fan, which is woken at once */
                take(&can, &frame);
        }
        if (now >= wake_can) { /* the thread of the foreign node */
            send_levels(&can, now);
            wake_can = now + (uint64_t)until_due(&can, now);
        }
        if (now >= wake_net) { /* the receiver and the sender of the shared bus */
            uint64_t wait = fsm_watch_every(&net.watch);
            call_for_hello(&net, now, &due);
            if (fsm_shared_read(&net.is_due) != 0u) {
                fsm_shared_write(&net.is_due, 0u);
                send_hello(&net);
            }
            wake_net = now + (due - now < wait ? due - now : wait);
        }
    }
    printf("%" PRIu64, completed);
    for (unsigned which = 0u; which < 2u; which++)
        printf(" %" PRIu64 " %" PRIu64, last_until(which, resume), first_from(which, resume));
    printf(" %u %u\n", sent_count[0], sent_count[1]);
}

int main(void)
{
    unsigned watchdog, cycle, period, hang_for;
    while (scanf("%u %u %u %u", &watchdog, &cycle, &period, &hang_for) == 4)
        play(watchdog, cycle, period, hang_for);
    return 0;
}
