/* fsm_link_keys.c: see fsm_link_keys.h. */
#include "fsm_link_keys.h"
#include "fsm_link_hello.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <zmq.h>

typedef char fsm_link_nodes_are_a_digit[FSM_LINK_NODES <= 64 ? 1 : -1];

enum { PATROL_MS = 10, ZAP_FRAMES = 7, ZAP_BYTES = 64 };

/* Answer one request for admission: version, id, domain, address, identity, mechanism, key. */
static void answer(const fsm_link_keys *keys)
{
    uint8_t parts[ZAP_FRAMES][ZAP_BYTES] = {{0}};
    int lengths[ZAP_FRAMES] = {0};
    int count = 0, more = 1;
    char known = '\0'; /* the node, as a digit: what messages carry as their User-Id */
    while (more != 0) {
        uint8_t rest[ZAP_BYTES];
        size_t size = sizeof more;
        uint8_t *into = count < ZAP_FRAMES ? parts[count] : rest;
        int length = zmq_recv(keys->door, into, ZAP_BYTES, 0);
        if (length < 0) {
            return;
        }
        if (count < ZAP_FRAMES) {
            lengths[count] = length;
        }
        count++;
        if (zmq_getsockopt(keys->door, ZMQ_RCVMORE, &more, &size) != 0) {
            return;
        }
    }
    if (count == ZAP_FRAMES && lengths[6] == 32 && lengths[5] == 5 &&
        memcmp(parts[5], "CURVE", 5) == 0) {
        for (unsigned node = 0u; node < keys->nodes; node++) {
            if (memcmp(keys->keys[node], parts[6], 32) == 0) {
                known = (char)('0' + node);
            }
        }
    }
    (void)zmq_send(keys->door, "1.0", 3, ZMQ_SNDMORE);
    (void)zmq_send(keys->door, parts[1],
                   count > 1 && lengths[1] <= ZAP_BYTES ? (size_t)lengths[1] : 0u, ZMQ_SNDMORE);
    (void)zmq_send(keys->door, known != '\0' ? "200" : "400", 3, ZMQ_SNDMORE);
    (void)zmq_send(keys->door, "", 0, ZMQ_SNDMORE);
    (void)zmq_send(keys->door, &known, known != '\0' ? 1u : 0u, ZMQ_SNDMORE);
    (void)zmq_send(keys->door, "", 0, 0);
}

static void *doorman(void *carrier)
{
    const fsm_link_keys *keys = carrier;
    while (fsm_shared_read(&keys->stop) == 0u) {
        zmq_pollitem_t item = {keys->door, 0, ZMQ_POLLIN, 0};
        if (zmq_poll(&item, 1, PATROL_MS) > 0) {
            answer(keys);
        }
    }
    return NULL;
}

bool fsm_link_keys_open(fsm_link_keys *keys, void *context, uint8_t nodes,
                        const char *const *public_keys)
{
    int none = 0;
    keys->nodes = nodes;
    for (unsigned node = 0u; node < nodes; node++) {
        if (zmq_z85_decode(keys->keys[node], public_keys[node]) == NULL) {
            return false;
        }
    }
    keys->door = zmq_socket(context, ZMQ_REP);
    if (keys->door == NULL ||
        zmq_setsockopt(keys->door, ZMQ_LINGER, &none, sizeof none) != 0 ||
        zmq_bind(keys->door, "inproc://zeromq.zap.01") != 0)
        return false;
    errno = pthread_create(&keys->doorman, NULL, doorman, keys);
    keys->has_doorman = errno == 0;
    return keys->has_doorman;
}

int fsm_link_keys_of(void *message)
{
    const char *known = zmq_msg_gets(message, "User-Id");
    return known != NULL && known[0] >= '0' ? known[0] - '0' : FSM_LINK_STRANGE_KEY;
}

void fsm_link_keys_close(fsm_link_keys *keys)
{
    fsm_shared_write(&keys->stop, 1u);
    if (keys->has_doorman) {
        (void)pthread_join(keys->doorman, NULL);
    }
    if (keys->door != NULL) {
        (void)zmq_close(keys->door);
    }
    keys->door = NULL;
    keys->has_doorman = false;
}

bool fsm_link_zmq_key(const char *path, const char *kind, char key[FSM_LINK_KEY])
{
    char line[256];
    bool is_found = false;
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        return false;
    }
    while (!is_found && fgets(line, sizeof line, file) != NULL) {
        const char *at = line + strspn(line, " \t");
        if (strncmp(at, kind, strlen(kind)) != 0) {
            continue;
        }
        at = strchr(at, '"');
        if (at != NULL && strcspn(at + 1, "\"") == FSM_LINK_KEY - 1) {
            memcpy(key, at + 1, FSM_LINK_KEY - 1);
            key[FSM_LINK_KEY - 1] = '\0';
            is_found = true;
        }
    }
    (void)fclose(file);
    return is_found;
}
