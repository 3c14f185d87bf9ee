/* fsm_link_endpoint.c: whether what is sent to an endpoint can leave this computer; the same as
 * is_loopback of fsmkit/system/deployment/addresses.py. */
#include "fsm_link_zmq.h"

#include <string.h>

static bool begins(const char **text, const char *with)
{
    size_t length = strlen(with);
    if (strncmp(*text, with, length) != 0) {
        return false;
    }
    *text += length;
    return true;
}

/* A number of up to three digits, at most 255, after a dot. */
static bool is_octet(const char **text)
{
    unsigned value = 0u, digits = 0u;
    if (!begins(text, ".")) {
        return false;
    }
    for (; digits < 3u && **text >= '0' && **text <= '9'; digits++) {
        value = 10u * value + (unsigned)(*(*text)++ - '0');
    }
    return digits > 0u && value <= 255u;
}

static bool is_local_host(const char **text)
{
    if (begins(text, "localhost") || begins(text, "[::1]")) {
        return true;
    }
    return begins(text, "127") && is_octet(text) && is_octet(text) && is_octet(text);
}

bool fsm_link_zmq_is_loopback(const char *endpoint)
{
    const char *at = endpoint;
    if (begins(&at, "ipc://") || begins(&at, "inproc://")) {
        return *at != '\0';
    }
    if (!begins(&at, "tcp://") || !is_local_host(&at) || !begins(&at, ":")) {
        return false;
    }
    return *at != '\0' && strspn(at, "0123456789*") == strlen(at);
}
