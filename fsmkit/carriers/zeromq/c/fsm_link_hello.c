/* fsm_link_hello.c: see fsm_link_hello.h; the same as ../introductions.py. */
#include "fsm_link_hello.h"

#include <stdio.h>
#include <string.h>

/* The offsets of a hello's parts. */
enum { MARK_AT = 0, SENDER_AT = 1, SESSION_AT = 2, TOKEN_AT = 6, ECHO_AT = 14 };

#define MARK 0x3Fu /* no frame starts with it */

static bool is_nothing(const uint8_t *token)
{
    return fsm_link_get_bytes(token, FSM_LINK_TOKEN) == 0u;
}

bool fsm_link_hello_init(fsm_link_hellos *all, uint8_t node, uint8_t nodes, uint32_t session)
{
    FILE *random = fopen("/dev/urandom", "rb");
    bool is_made = random != NULL;
    memset(all, 0, sizeof *all);
    all->node = node;
    all->nodes = nodes;
    all->session = session;
    for (unsigned peer = 0u; is_made && peer < FSM_LINK_NODES; peer++) {
        uint8_t *token = all->of[peer].token;
        do {
            is_made = fread(token, 1u, FSM_LINK_TOKEN, random) == FSM_LINK_TOKEN;
        } while (is_made && is_nothing(token));
    }
    if (random != NULL) {
        (void)fclose(random);
    }
    return is_made;
}

/* Both halves are not read as one; a hello with halves of two tokens shows nothing, the next does. */
void fsm_link_hello_write(const fsm_link_hellos *all, uint8_t peer, uint8_t *hello)
{
    const fsm_link_acquaintance *of = &all->of[peer];
    hello[MARK_AT] = MARK;
    hello[SENDER_AT] = all->node;
    fsm_link_put_bytes(hello + SESSION_AT, all->session, 4u);
    memcpy(hello + TOKEN_AT, of->token, FSM_LINK_TOKEN);
    fsm_link_put_bytes(hello + ECHO_AT, fsm_shared_read(&of->peer_token[0]), 4u);
    fsm_link_put_bytes(hello + ECHO_AT + 4, fsm_shared_read(&of->peer_token[1]), 4u);
}

int fsm_link_hello_receive(fsm_link_hellos *all, const uint8_t *bytes, size_t length,
                        const uint8_t *route, size_t route_length, int key_of, uint64_t now_ms)
{
    fsm_link_acquaintance *of;
    uint32_t session;
    bool is_shown;
    if (length != FSM_LINK_HELLO || route_length != FSM_LINK_ROUTE || bytes[MARK_AT] != MARK ||
        bytes[SENDER_AT] >= all->nodes || bytes[SENDER_AT] == all->node ||
        is_nothing(bytes + TOKEN_AT))
        return -1;
    session = (uint32_t)fsm_link_get_bytes(bytes + SESSION_AT, 4u);
    if (session == 0u || (key_of != FSM_LINK_NO_KEYS && key_of != (int)bytes[SENDER_AT])) {
        return -1;
    }
    of = &all->of[bytes[SENDER_AT]];
    is_shown = memcmp(bytes + ECHO_AT, of->token, FSM_LINK_TOKEN) == 0;
    if (!is_shown && fsm_shared_own(&of->session) != 0u) {
        return -1; /* an impostor does not disturb a peer that is known */
    }
    fsm_shared_write(&of->peer_token[0], (FSM_INDEX)fsm_link_get_bytes(bytes + TOKEN_AT, 4u));
    fsm_shared_write(&of->peer_token[1], (FSM_INDEX)fsm_link_get_bytes(bytes + TOKEN_AT + 4, 4u));
    if (!is_shown) {
        return -1;
    }
    memcpy(of->route, route, FSM_LINK_ROUTE);
    of->at_ms = now_ms;
    fsm_shared_write(&of->session, (FSM_INDEX)session);
    return bytes[SENDER_AT];
}

void fsm_link_hello_forget(fsm_link_hellos *all, uint8_t peer)
{
    fsm_shared_write(&all->of[peer].session, 0u);
}

void fsm_link_hello_pass_time(fsm_link_hellos *all, uint64_t now_ms)
{
    for (uint8_t peer = 0u; peer < all->nodes; peer++) {
        const fsm_link_acquaintance *of = &all->of[peer];
        if (fsm_shared_own(&of->session) != 0u && now_ms - of->at_ms > FSM_LINK_GONE_MS) {
            fsm_link_hello_forget(all, peer);
        }
    }
}
