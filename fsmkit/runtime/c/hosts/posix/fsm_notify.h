/* fsm_notify.h: a supervisor of processes learns that a real-time loop runs: the protocol of sd_notify
 * (systemd, NOTIFY_SOCKET), without libsystemd.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   static fsm_notify notify;
 *   error = fsm_notify_open(&notify);           before the loop; it starts a thread
 *   ...
 *   fsm_notify_beat(&notify);                   in each cycle of the loop
 *   fsm_notify_ready(&notify);                  once, e.g. when the other nodes were heard
 *   fsm_notify_status(&notify, "producing");    now and then, e.g. once a second
 *   ...
 *   fsm_notify_close(&notify);                  after the loop
 *
 * The loop makes no system call for it: it writes memory, a thread sends. The thread sends WATCHDOG=1 only if
 * the loop has begun a cycle since the last time, so a loop that hangs is noticed while the thread lives.
 * Where nobody listens, all calls do nothing. Nothing is allocated but the stack of the thread. */
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

    /* Its own. */
    int socket; /* -1: nobody listens */
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
 * real-time priority. Returns 0, also where nobody listens, or an errno. */
int fsm_notify_open(fsm_notify *notify);

/* From the loop's thread alone. A status that comes while the one before was not sent yet is dropped; one that
 * is too long is cut, and its line ends become blanks. */
void fsm_notify_beat(fsm_notify *notify);
void fsm_notify_ready(fsm_notify *notify);
void fsm_notify_status(fsm_notify *notify, const char *status);

/* Say that the process stops, and end the thread. */
void fsm_notify_close(fsm_notify *notify);

#ifdef __cplusplus
}
#endif

#endif
