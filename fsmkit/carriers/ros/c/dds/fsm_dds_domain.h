/* fsm_dds_domain.h: a domain of DDS, as the carriers of a program share it.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * DDS without DDS Security proves of nobody who publishes. A domain is therefore confined to the
 * loopback interface of this computer, whatever CYCLONEDDS_URI says, unless it is insecure: then it is
 * configured by CYCLONEDDS_URI alone. POSIX, Cyclone DDS 0.10. */
#ifndef FSM_DDS_DOMAIN_H
#define FSM_DDS_DOMAIN_H

#include <dds/dds.h>
#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_DDS_DOMAINS /* that a program joins at once */
#define FSM_DDS_DOMAINS 8
#endif

typedef struct {
    uint32_t id;
    bool is_insecure;
    int priority; /* SCHED_FIFO of the threads of DDS that receive and repeat; 0: as the process is */
} fsm_dds_domain;

/* Return a participant; or an errno or a code of DDS, both negative: -EPERM without the right for the
 * priority, DDS_RETCODE_PRECONDITION_NOT_MET if the program has opened the domain in another way. The
 * first who joins a domain decides on the priority. Calls DDS. */
dds_entity_t fsm_dds_join(const fsm_dds_domain *domain);

/* Delete the participant with all it has; the domain when the last has left. Calls DDS. */
void fsm_dds_leave(dds_entity_t participant);

#ifdef __cplusplus
}
#endif

#endif
