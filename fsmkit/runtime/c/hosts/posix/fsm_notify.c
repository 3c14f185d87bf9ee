/* fsm_notify.c. Copyright the fsmkit authors, Apache-2.0; see fsm_notify.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_notify.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
    STACK_BYTES = 65536, /* all of it is locked where the process locks its memory */
    LONGEST_PAUSE_US = 100000, /* until a status or READY goes out */
    PAUSES_PER_WATCHDOG = 4
};

/* ---- what goes out ------------------------------------------------------------------------------ */

/* A supervisor that does not take it in misses it; the next watchdog comes soon. */
static void tell(const fsm_notify *notify, const char *message)
{
    (void)sendto(notify->socket, message, strlen(message), MSG_DONTWAIT | MSG_NOSIGNAL,
                 (const struct sockaddr *)&notify->address, notify->address_length);
}

static void tell_status(fsm_notify *notify)
{
    static const char key[] = "STATUS=";
    char message[sizeof key + FSM_NOTIFY_STATUS];
    if (fsm_shared_read(&notify->status) == 0u) {
        return;
    }
    memcpy(message, key, sizeof key - 1u);
    memcpy(message + sizeof key - 1u, notify->text, FSM_NOTIFY_STATUS);
    fsm_shared_write(&notify->status, 0u);
    tell(notify, message);
}

static uint64_t now_us(void)
{
    struct timespec now = {0, 0};
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static void *send_all(void *of)
{
    fsm_notify *const notify = of;
    const uint64_t every = notify->watchdog_us / PAUSES_PER_WATCHDOG;
    const uint64_t pause =
        every > 0u && every < LONGEST_PAUSE_US ? every : (uint64_t)LONGEST_PAUSE_US;
    const struct timespec sleep = {0, (long)(pause * 1000u)};
    FSM_INDEX beats = fsm_shared_read(&notify->beats);
    uint64_t due = now_us();
    bool was_ready = false;
    while (fsm_shared_read(&notify->over) == 0u) {
        const FSM_INDEX cycles = fsm_shared_read(&notify->beats);
        if (!was_ready && fsm_shared_read(&notify->ready) != 0u) {
            was_ready = true;
            tell(notify, "READY=1");
        }
        tell_status(notify);
        if (every > 0u && cycles != beats && now_us() >= due) {
            beats = cycles;
            due = now_us() + every;
            tell(notify, "WATCHDOG=1");
        }
        (void)nanosleep(&sleep, NULL);
    }
    tell_status(notify);
    tell(notify, "STOPPING=1");
    return NULL;
}

/* ---- set-up ------------------------------------------------------------------------------------- */

/* Read a path, or a name that starts with `@` and is in no file system (Linux). */
static bool read_address(fsm_notify *notify, const char *name)
{
    const size_t length = strlen(name);
    if ((name[0] != '/' && name[0] != '@') || length < 2u ||
        length >= sizeof notify->address.sun_path)
        return false;
    notify->address.sun_family = AF_UNIX;
    memcpy(notify->address.sun_path, name, length + 1u);
    if (name[0] == '@') {
        notify->address.sun_path[0] = '\0';
    }
    notify->address_length = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    return true;
}

/* WATCHDOG_PID, where it is set, names the process that is watched. */
static uint64_t read_watchdog(void)
{
    const char *const period = getenv("WATCHDOG_USEC");
    const char *const process = getenv("WATCHDOG_PID");
    if (period == NULL || (process != NULL && strtoll(process, NULL, 10) != (long long)getpid())) {
        return 0u;
    }
    return (uint64_t)strtoull(period, NULL, 10);
}

/* The thread does not inherit the priority of its maker: it must not be in the loop's way. */
static int start_thread(fsm_notify *notify)
{
    const struct sched_param none = {0};
    pthread_attr_t attributes;
    int error = pthread_attr_init(&attributes);
    if (error != 0) {
        return error;
    }
    error = pthread_attr_setstacksize(&attributes, STACK_BYTES);
    if (error == 0) {
        error = pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    }
    if (error == 0) {
        error = pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
    }
    if (error == 0) {
        error = pthread_attr_setschedparam(&attributes, &none);
    }
    if (error == 0) {
        error = pthread_create(&notify->thread, &attributes, send_all, notify);
    }
    (void)pthread_attr_destroy(&attributes);
    return error;
}

int fsm_notify_open(fsm_notify *notify)
{
    const char *const name = getenv("NOTIFY_SOCKET");
    int error;
    memset(notify, 0, sizeof *notify);
    notify->socket = -1;
    if (name == NULL || name[0] == '\0') {
        return 0;
    }
    if (!read_address(notify, name)) {
        return EINVAL;
    }
    notify->watchdog_us = read_watchdog();
    notify->socket = socket(AF_UNIX, SOCK_DGRAM, 0);
    if (notify->socket < 0) {
        return errno;
    }
    error = start_thread(notify);
    if (error != 0) {
        (void)close(notify->socket);
        notify->socket = -1;
    }
    return error;
}

void fsm_notify_close(fsm_notify *notify)
{
    if (notify->socket < 0) {
        return;
    }
    fsm_shared_write(&notify->over, 1u);
    (void)pthread_join(notify->thread, NULL);
    (void)close(notify->socket);
    notify->socket = -1;
}

/* ---- the loop's side ------------------------------------------------------------------------------ */

void fsm_notify_beat(fsm_notify *notify)
{
    fsm_shared_write(&notify->beats, (FSM_INDEX)(fsm_shared_own(&notify->beats) + 1u));
}

void fsm_notify_ready(fsm_notify *notify)
{
    fsm_shared_write(&notify->ready, 1u);
}

void fsm_notify_status(fsm_notify *notify, const char *status)
{
    size_t length = 0;
    if (notify->socket < 0 || fsm_shared_read(&notify->status) != 0u) {
        return;
    }
    for (; status[length] != '\0' && length < FSM_NOTIFY_STATUS - 1u; length++) {
        notify->text[length] = status[length] != '\n' ? status[length] : ' ';
    }
    notify->text[length] = '\0';
    fsm_shared_write(&notify->status, 1u);
}
