#define _POSIX_C_SOURCE 200809L
#include "search/workers.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

/* --- the lock ------------------------------------------------------------------------------------- */

struct fsm_lock {
    pthread_mutex_t mutex;
};

fsm_lock *fsm_lock_make(void)
{
    pthread_mutexattr_t kind;
    fsm_lock *self = malloc(sizeof *self);
    if (self == NULL || pthread_mutexattr_init(&kind) != 0) {
        free(self);
        return NULL;
    }
    bool fine = pthread_mutexattr_settype(&kind, PTHREAD_MUTEX_RECURSIVE) == 0
        && pthread_mutex_init(&self->mutex, &kind) == 0;
    (void)pthread_mutexattr_destroy(&kind);
    if (fine)
        return self;
    free(self);
    return NULL;
}

void fsm_lock_free(fsm_lock *self)
{
    if (self != NULL)
        (void)pthread_mutex_destroy(&self->mutex);
    free(self);
}

void fsm_lock_take(fsm_lock *self)
{
    (void)pthread_mutex_lock(&self->mutex);
}

void fsm_lock_leave(fsm_lock *self)
{
    (void)pthread_mutex_unlock(&self->mutex);
}

/* --- workers -------------------------------------------------------------------------------------- */

typedef struct {
    fsm_workers *all;
    uint32_t number;
    pthread_t thread;
} worker;

struct fsm_workers {
    pthread_mutex_t mutex;
    pthread_cond_t started, ended;
    uint32_t count;
    uint32_t active; /* who works, the caller apart */
    uint32_t round;  /* of work */
    bool open;       /* there is work; who wakes up too late for it waits for the next round */
    bool stop;
    fsm_work *work;
    void *context;
    worker workers[FSM_MOST_WORKERS];
};

static void *serve(void *argument)
{
    const worker *self = argument;
    fsm_workers *all = self->all;
    uint32_t done = 0;
    (void)pthread_mutex_lock(&all->mutex);
    for (;;) {
        while ((!all->open || all->round == done) && !all->stop)
            (void)pthread_cond_wait(&all->started, &all->mutex);
        if (all->stop)
            break;
        done = all->round;
        all->active++;
        (void)pthread_mutex_unlock(&all->mutex);
        all->work(all->context, self->number);
        (void)pthread_mutex_lock(&all->mutex);
        if (--all->active == 0)
            (void)pthread_cond_signal(&all->ended);
    }
    (void)pthread_mutex_unlock(&all->mutex);
    return NULL;
}

/* Signals are for the caller's thread. */
static void start_threads(fsm_workers *self, uint32_t count)
{
    sigset_t all, before;
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_SETMASK, &all, &before);
    for (; self->count < count; self->count++) {
        worker *one = &self->workers[self->count];
        *one = (worker){.all = self, .number = self->count};
        if (pthread_create(&one->thread, NULL, serve, one) != 0)
            break;
    }
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
}

fsm_workers *fsm_workers_start(uint32_t count)
{
    fsm_workers *self = calloc(1, sizeof *self);
    if (self == NULL)
        return NULL;
    (void)pthread_mutex_init(&self->mutex, NULL);
    (void)pthread_cond_init(&self->started, NULL);
    (void)pthread_cond_init(&self->ended, NULL);
    self->count = 1;
    start_threads(self, count < FSM_MOST_WORKERS ? count : FSM_MOST_WORKERS);
    if (self->count > 1)
        return self;
    fsm_workers_stop(self);
    return NULL;
}

void fsm_workers_stop(fsm_workers *self)
{
    if (self == NULL)
        return;
    (void)pthread_mutex_lock(&self->mutex);
    self->stop = true;
    (void)pthread_cond_broadcast(&self->started);
    (void)pthread_mutex_unlock(&self->mutex);
    for (uint32_t i = 1; i < self->count; i++)
        (void)pthread_join(self->workers[i].thread, NULL);
    (void)pthread_cond_destroy(&self->started);
    (void)pthread_cond_destroy(&self->ended);
    (void)pthread_mutex_destroy(&self->mutex);
    free(self);
}

uint32_t fsm_workers_count(const fsm_workers *self)
{
    return self->count;
}

void fsm_workers_run(fsm_workers *self, fsm_work *work, void *context)
{
    (void)pthread_mutex_lock(&self->mutex);
    self->work = work;
    self->context = context;
    self->round++;
    self->open = true;
    (void)pthread_cond_broadcast(&self->started);
    (void)pthread_mutex_unlock(&self->mutex);
    work(context, 0);
    (void)pthread_mutex_lock(&self->mutex);
    self->open = false;
    while (self->active > 0)
        (void)pthread_cond_wait(&self->ended, &self->mutex);
    (void)pthread_mutex_unlock(&self->mutex);
}
