/* posix_notify.c: a loop of 1 kHz that is supervised. It is ready after 50 cycles, says a status, hangs for as
 * many milliseconds as the argument names in cycle 300, and ends by SIGTERM. */
#define _POSIX_C_SOURCE 200809L
#include "posix/fsm_notify.h"
#include "posix/fsm_posix.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static fsm_posix host;
static fsm_notify notify;
static long hang_ms;
static unsigned cycles;

static void step(void *unused, uint32_t now)
{
    (void)unused;
    (void)now;
    cycles++;
    fsm_notify_beat(&notify);
    if (cycles == 50u) {
        fsm_notify_ready(&notify);
        fsm_notify_status(&notify, "producing\n0 lost, a long line that is cut "
                                   "............................................................"
                                   "............................................................");
    }
    if (cycles == 300u && hang_ms > 0) {
        const struct timespec pause = {hang_ms / 1000, (hang_ms % 1000) * 1000000};
        (void)nanosleep(&pause, NULL);
    }
}

int main(int argc, char **argv)
{
    int error;
    hang_ms = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    if (fsm_posix_init(&host, 1000u) != 0 || fsm_posix_stop_on(&host, SIGTERM) != 0)
        return 2;
    error = fsm_notify_open(&notify);
    printf("open: %d, watchdog %lu us\n", error, (unsigned long)notify.watchdog_us);
    (void)fflush(stdout);
    if (fsm_posix_periodic(&host, step, NULL) != 0)
        return 2;
    fsm_notify_close(&notify);
    fsm_posix_close(&host);
    printf("over\n");
    return 0;
}
