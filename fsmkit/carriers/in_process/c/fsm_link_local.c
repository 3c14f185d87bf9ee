/* fsm_link_local.c: see fsm_link_local.h. */
#include "fsm_link_local.h"

static void wake(void *carrier, fsm_link *link)
{
    const fsm_link_local *wire = carrier;
    fsm_link_frame frame;
    while (fsm_link_next(link, &frame)) {
        for (unsigned node = 0u; node < FSM_LINK_NODES; node++) {
            if (wire->links[node] != NULL && wire->links[node] != link) {
                (void)fsm_link_arrive(wire->links[node], link->map->node, frame.bytes, frame.length);
            }
        }
    }
}

/* Everything that was sent has come already. */
static bool receive(void *carrier, fsm_link *link, uint8_t peer, uint32_t timeout_ms)
{
    (void)carrier;
    (void)link;
    (void)peer;
    (void)timeout_ms;
    return false;
}

static bool heard_by(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms)
{
    const fsm_link_local *wire = carrier;
    (void)link;
    (void)timeout_ms;
    return peer < FSM_LINK_NODES && wire->links[peer] != NULL &&
           (session == 0u || wire->links[peer]->session == session);
}

void fsm_link_local_join(fsm_link_local *wire, fsm_link *link)
{
    static const fsm_link_transport transport = {wake, receive, heard_by, true};
    wire->links[link->map->node] = link;
    fsm_link_attach(link, &transport, wire);
}
