/* fsm_notify.h: report to a supervisor that a real-time loop runs: the protocol of sd_notify (systemd,
 * NOTIFY_SOCKET), without libsystemd.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   static fsm_notify notify;
 *   error = fsm_notify_open(&notify);           before the loop; it starts a thread
 *   ...
 *   fsm_notify_beat(&notify);                   in each cycle of the loop
 *   fsm_notify_ready(&notify);                  once, e.g. after a frame of each node
 *   fsm_notify_status(&notify, "producing");    repeatedly, e.g. once a second
 *   ...
 *   fsm_notify_close(&notify);                  after the loop
 *
 * The loop makes no system call: it writes memory, and a thread sends. The thread sends WATCHDOG=1 only if
 * the loop has started a cycle since the last time, so a hung loop is detected while the thread lives.
 * Without a supervisor, all calls do nothing. Only the stack of the thread is allocated. */
#ifndef FSM_NOTIFY_H
#define FSM_NOTIFY_H

#include "fsm_shared.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/un.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FSM_NOTIFY_STATUS 120 /* bytes of a status, with the zero at its end */

typedef struct {
    uint64_t watchdog_us; /* the supervisor's, from WATCHDOG_USEC; 0: it has none */

    /* Internal. */
    int socket; /* -1: no supervisor */
    struct sockaddr_un address;
    socklen_t address_length;
    pthread_t thread;
    fsm_shared beats;  /* cycles, by the loop */
    fsm_shared ready;  /* 1 from fsm_notify_ready on */
    fsm_shared over;   /* 1: the thread ends */
    fsm_shared status; /* 1: `text` is the thread's, which sets 0 when it has sent it */
    char text[FSM_NOTIFY_STATUS];
} fsm_notify;

/* Connect to the supervisor that the environment names, and start the thread that sends. The thread has no
 * real-time priority. Return 0, also without a supervisor, or an errno. */
int fsm_notify_open(fsm_notify *notify);

/* For the loop's thread only. A status is dropped while the previous one is unsent. A long one is
 * truncated, and its line ends become spaces. */
void fsm_notify_beat(fsm_notify *notify);
void fsm_notify_ready(fsm_notify *notify);
void fsm_notify_status(fsm_notify *notify, const char *status);

/* Report that the process stops, and end the thread. */
void fsm_notify_close(fsm_notify *notify);

#ifdef __cplusplus
}
#endif

#endif
