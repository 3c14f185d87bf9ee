/* fsm_link_fan.c: see fsm_link_fan.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_fan.h"

#include <errno.h>
#include <sched.h>
#include <string.h>
#include <time.h>

static void take(void *carrier, const fsm_link_frame *frame)
{
    fsm_link_fan *fan = carrier;
    for (unsigned peer = 0u; peer < FSM_LINK_NODES; peer++) {
        if (fan->peers[peer].send != NULL) {
            fan->peers[peer].send(fan->peers[peer].translator, frame);
        }
    }
}

static void enter(void *carrier)
{
    fsm_link_fan *fan = carrier;
    (void)pthread_mutex_lock(&fan->turn);
}

static void leave(void *carrier)
{
    fsm_link_fan *fan = carrier;
    (void)pthread_mutex_unlock(&fan->turn);
}

static void wake(void *carrier, fsm_link *link)
{
    fsm_link_fan *fan = carrier;
    if (fan->inner != NULL) {
        fan->inner->wake(fan->inner_carrier, link);
    } else if (fan->every_us == 0u) {
        (void)sem_post(&fan->work);
    }
}

static bool is_foreign(const fsm_link_fan *fan, uint8_t peer)
{
    return peer >= FSM_LINK_NODES || fan->peers[peer].send != NULL;
}

static bool receive(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms)
{
    const fsm_link_fan *fan = carrier;
    return !is_foreign(fan, peer) &&
           fan->inner->receive(fan->inner_carrier, link, peer, timeout_ms);
}

/* Nobody is known to listen on a bus, so a foreign node is never waited for. */
static bool heard_by(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms)
{
    const fsm_link_fan *fan = carrier;
    if (is_foreign(fan, peer)) {
        return true;
    }
    return fan->inner != NULL && fan->inner->heard_by != NULL &&
           fan->inner->heard_by(fan->inner_carrier, link, peer, session, timeout_ms);
}

/* Wait for the end of a cycle, or for the next period; a late thread starts a new period. */
static void wait_for_work(fsm_link_fan *fan, struct timespec *due)
{
    struct timespec now;
    if (fan->every_us == 0u) {
        while (sem_wait(&fan->work) != 0) {
            ;
        }
        return;
    }
    due->tv_sec += (time_t)(fan->every_us / 1000000u);
    due->tv_nsec += (long)(fan->every_us % 1000000u) * 1000;
    if (due->tv_nsec >= 1000000000) {
        due->tv_nsec -= 1000000000;
        due->tv_sec++;
    }
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    if (now.tv_sec > due->tv_sec || (now.tv_sec == due->tv_sec && now.tv_nsec > due->tv_nsec)) {
        *due = now;
    }
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, due, NULL) == EINTR) {
        ;
    }
}

static void *run_sender(void *carrier)
{
    fsm_link_fan *fan = carrier;
    struct timespec due;
    (void)clock_gettime(CLOCK_MONOTONIC, &due);
    while (fsm_shared_read(&fan->stop) == 0u) {
        fsm_link_frame frame;
        wait_for_work(fan, &due);
        while (fsm_link_next(fan->link, &frame)) { /* which hands it to `take` */
            ;
        }
        if (fan->link->faults != NULL) {
            fsm_link_pass_time(fan->link);
        }
    }
    return NULL;
}

int fsm_link_fan_open(fsm_link_fan *fan, fsm_link *link)
{
    static const fsm_link_beside beside = {take, enter, leave};
    int error;
    memset(fan, 0, sizeof *fan);
    fan->link = link;
    error = pthread_mutex_init(&fan->turn, NULL);
    if (error == 0) {
        fsm_link_set_beside(link, &beside, fan);
    }
    return error;
}

void fsm_link_fan_add(fsm_link_fan *fan, uint8_t peer, fsm_link_fan_send *send, void *translator)
{
    fan->peers[peer].translator = translator;
    fan->peers[peer].send = send;
    fan->peers[peer].session = 1u;
}

int fsm_link_fan_start(fsm_link_fan *fan, int priority)
{
    int error;
    fan->inner = fan->link->transport;
    fan->inner_carrier = fan->link->carrier;
    fan->transport.wake = wake;
    fan->transport.receive = fan->inner != NULL && fan->inner->receive != NULL ? receive : NULL;
    fan->transport.heard_by = heard_by;
    fan->transport.is_proven = fan->inner != NULL && fan->inner->is_proven;
    fsm_link_attach(fan->link, &fan->transport, fan);
    if (fan->inner != NULL) {
        return 0;
    }
    if (sem_init(&fan->work, 0, 0u) != 0) {
        return errno;
    }
    fan->has_work = true;
    error = pthread_create(&fan->sender, NULL, run_sender, fan);
    fan->has_sender = error == 0;
    if (fan->has_sender && priority > 0) {
        struct sched_param wish;
        memset(&wish, 0, sizeof wish);
        wish.sched_priority = priority;
        error = pthread_setschedparam(fan->sender, SCHED_FIFO, &wish);
    }
    return error;
}

bool fsm_link_fan_arrive(fsm_link_fan *fan, uint8_t peer, uint16_t message, const uint8_t *payload,
                         uint16_t size)
{
    fsm_link_head head;
    head.sender = peer;
    head.hash = fan->link->map->hash;
    head.session = fan->peers[peer].session;
    head.sequence = fan->peers[peer].sequence;
    head.events = fan->peers[peer].events;
    head.message = message;
    if (!fsm_link_arrive_as(fan->link, &head, payload, size)) {
        return false;
    }
    fan->peers[peer].sequence++;
    fan->peers[peer].events += message != FSM_LINK_LEVELS ? 1u : 0u;
    return true;
}

void fsm_link_fan_missed(fsm_link_fan *fan, uint8_t peer, uint32_t events)
{
    fan->peers[peer].sequence += events;
    fan->peers[peer].events += events;
}

void fsm_link_fan_restarted(fsm_link_fan *fan, uint8_t peer)
{
    fan->peers[peer].session++;
    fan->peers[peer].sequence = fan->peers[peer].events = 0u;
}

void fsm_link_fan_close(fsm_link_fan *fan)
{
    fsm_link_attach(fan->link, NULL, NULL);
    if (fan->has_sender) {
        fsm_shared_write(&fan->stop, 1u);
        (void)sem_post(&fan->work);
        (void)pthread_join(fan->sender, NULL);
    }
    if (fan->has_work) {
        (void)sem_destroy(&fan->work);
    }
    fsm_link_set_beside(fan->link, NULL, NULL);
    (void)pthread_mutex_destroy(&fan->turn);
    fan->has_sender = fan->has_work = false;
}
