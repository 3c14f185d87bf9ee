/* fsm_dds_diagnostics.h: what a node counts, on the topic /diagnostics of ROS 2, once a second.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   static const char *const machines[] = {"camera", "belt"};
 *   static const fsm_dds_domain domain = {7u, false, 0};
 *   fsm_dds_diagnostics_open(&diagnostics, &link, &domain, "Cell", machines, 2u);
 *   once a cycle:
 *     fsm_dds_diagnostics_note(&diagnostics, 0u, camera_fault(&node.camera));
 *   ...
 *   fsm_dds_diagnostics_close(&diagnostics);                        before the link goes
 *
 * A diagnostic_msgs/msg/DiagnosticArray has a status of the node, one of its link to each other node,
 * and one of each machine: an error if the machine has stopped by a fault, a warning if a counter has
 * moved since the message before, an error of the node if its loop hangs (fsm_watch.h). A thread
 * publishes; the loop makes no call of DDS. Compile
 * fsm_diagnostic_msgs.idl by `idlc -t`. POSIX, Cyclone DDS 0.10. */
#ifndef FSM_DDS_DIAGNOSTICS_H
#define FSM_DDS_DIAGNOSTICS_H

#include "fsm_dds_domain.h"
#include "fsm_link.h"

#include <pthread.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef FSM_DDS_DIAGNOSTICS_MACHINES
#define FSM_DDS_DIAGNOSTICS_MACHINES 16
#endif

enum { FSM_DDS_DIAGNOSTICS_COUNTERS = 8, FSM_DDS_DIAGNOSTICS_TEXT = 96 };

typedef struct {
    const fsm_link *link;
    const char *system;
    const char *const *machines;
    unsigned machine_count;
    dds_entity_t participant, writer, stop, waitset;
    pthread_t thread;
    bool has_thread;
    fsm_shared silence[FSM_LINK_NODES]; /* the loop's own, as those that follow */
    fsm_shared fault[FSM_DDS_DIAGNOSTICS_MACHINES];
    fsm_shared overruns;
    fsm_watch watch; /* of the loop; the thread's own, as the next */
    uint32_t before[FSM_LINK_NODES][FSM_DDS_DIAGNOSTICS_COUNTERS];
} fsm_dds_diagnostics;

/* Publish in a domain (fsm_dds_domain.h); the texts stay where they are. 0, an errno, or a code of DDS,
 * which is negative. Calls DDS. */
int fsm_dds_diagnostics_open(fsm_dds_diagnostics *d, const fsm_link *link,
                             const fsm_dds_domain *domain, const char *system,
                             const char *const *machines, unsigned count);

/* The loop: how a machine is, 0 for no fault; how long peers have been silent. Makes no call. */
void fsm_dds_diagnostics_note(fsm_dds_diagnostics *d, unsigned machine, unsigned fault);

/* The loop: cycles that started too late, since its start. */
void fsm_dds_diagnostics_overran(fsm_dds_diagnostics *d, uint32_t overruns);

/* End the thread. Calls DDS. */
void fsm_dds_diagnostics_close(fsm_dds_diagnostics *d);

#ifdef __cplusplus
}
#endif

#endif
