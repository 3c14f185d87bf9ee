/* fsm_dds_domain.c: see fsm_dds_domain.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_dds_domain.h"

#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BEGIN "<CycloneDDS><Domain Id=\"any\">"
#define END "</Domain></CycloneDDS>"
#define LOOPBACK                                                                                   \
    "<General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"false\"/>"           \
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"                     \
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>" \
    "<Peers><Peer Address=\"127.0.0.1\"/></Peers><LeaseDuration>2s</LeaseDuration>"    \
    "<SPDPInterval>500ms</SPDPInterval></Discovery>"

/* several threads that receive have names that cannot be configured */
#define ONE_RECEIVER "<Internal><MultipleReceiveThreads>false</MultipleReceiveThreads></Internal>"

enum { ROOM = 4096 };

static struct {
    uint32_t id;
    bool is_insecure;
    unsigned uses;
    dds_entity_t entity; /* 0: the program opened the domain itself */
} domains[FSM_DDS_DOMAINS];
static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;

static bool append(char *text, const char *more)
{
    size_t used = strlen(text), size = strlen(more);
    if (used + size >= ROOM) {
        return false;
    }
    memcpy(text + used, more, size + 1u);
    return true;
}

/* Write the configuration; false: there is no room for it. */
static bool configure(char *text, const fsm_dds_domain *domain)
{
    /* threads of DDS that stand between a message and its reader */
    static const char *const threads[] = {"recv", "tev"};
    const char *given = domain->is_insecure ? getenv("CYCLONEDDS_URI") : NULL;
    bool fits = true;
    text[0] = '\0';
    if (given != NULL && given[0] != '\0') {
        fits = append(text, given) && append(text, ",");
    }
    fits = fits && append(text, BEGIN);
    if (!domain->is_insecure) {
        fits = fits && append(text, LOOPBACK);
    }
    if (domain->priority > 0) {
        fits = fits && append(text, ONE_RECEIVER "<Threads>");
        for (size_t place = 0u; place < sizeof threads / sizeof threads[0]; place++) {
            char row[160];
            (void)snprintf(row, sizeof row,
                           "<Thread Name=\"%s\"><Scheduling><Class>realtime</Class>"
                           "<Priority>%d</Priority></Scheduling></Thread>",
                           threads[place], domain->priority);
            fits = fits && append(text, row);
        }
        fits = fits && append(text, "</Threads>");
    }
    return fits && append(text, END);
}

static void *nothing(void *unused)
{
    return unused;
}

/* Whether the system lets a thread have the priority: DDS says only that there is no thread. */
static int try_priority(int priority)
{
    pthread_attr_t attributes;
    pthread_t thread;
    struct sched_param wish;
    int error = pthread_attr_init(&attributes);
    if (error != 0) {
        return error;
    }
    memset(&wish, 0, sizeof wish);
    wish.sched_priority = priority;
    (void)pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    (void)pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    error = pthread_attr_setschedparam(&attributes, &wish);
    if (error == 0) {
        error = pthread_create(&thread, &attributes, nothing, NULL);
    }
    if (error == 0) {
        (void)pthread_join(thread, NULL);
    }
    (void)pthread_attr_destroy(&attributes);
    return error;
}

static dds_entity_t create(const fsm_dds_domain *domain)
{
    char text[ROOM];
    int error = domain->priority > 0 ? try_priority(domain->priority) : 0;
    dds_entity_t found;
    if (error != 0) {
        return -error;
    }
    if (!configure(text, domain)) {
        return -E2BIG;
    }
    found = dds_create_domain(domain->id, text);
    if (found == DDS_RETCODE_PRECONDITION_NOT_MET && domain->is_insecure) {
        return 0; /* as the program has opened it */
    }
    return found;
}

dds_entity_t fsm_dds_join(const fsm_dds_domain *domain)
{
    dds_entity_t found = DDS_RETCODE_OUT_OF_RESOURCES;
    size_t place = 0u, room = FSM_DDS_DOMAINS;
    (void)pthread_mutex_lock(&turn);
    while (place < FSM_DDS_DOMAINS && (domains[place].uses == 0u || domains[place].id != domain->id)) {
        room = domains[place].uses == 0u ? place : room;
        place++;
    }
    if (place < FSM_DDS_DOMAINS) {
        found = domains[place].is_insecure == domain->is_insecure
                    ? dds_create_participant(domain->id, NULL, NULL)
                    : DDS_RETCODE_PRECONDITION_NOT_MET;
    } else if (room < FSM_DDS_DOMAINS) {
        place = room;
        domains[place].id = domain->id;
        domains[place].is_insecure = domain->is_insecure;
        domains[place].entity = create(domain);
        found = domains[place].entity;
        if (found >= 0) {
            found = dds_create_participant(domain->id, NULL, NULL);
        }
        if (found < 0 && domains[place].entity > 0) {
            (void)dds_delete(domains[place].entity);
        }
    }
    if (found > 0) {
        domains[place].uses++;
    }
    (void)pthread_mutex_unlock(&turn);
    return found;
}

void fsm_dds_leave(dds_entity_t participant)
{
    dds_domainid_t id;
    if (participant <= 0 || dds_get_domainid(participant, &id) != DDS_RETCODE_OK) {
        return;
    }
    (void)pthread_mutex_lock(&turn);
    (void)dds_delete(participant);
    for (size_t place = 0u; place < FSM_DDS_DOMAINS; place++) {
        if (domains[place].uses == 0u || domains[place].id != id) {
            continue;
        }
        domains[place].uses--;
        if (domains[place].uses == 0u && domains[place].entity > 0) {
            (void)dds_delete(domains[place].entity);
        }
        break;
    }
    (void)pthread_mutex_unlock(&turn);
}
