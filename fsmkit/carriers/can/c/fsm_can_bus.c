/* fsm_can_bus.c: see fsm_can_bus.h. */
#define _DEFAULT_SOURCE
#define _POSIX_C_SOURCE 200809L

#include "fsm_can_bus.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#ifdef __linux__
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#endif

enum {
    CLASSICAL = 16, /* sizeof(struct can_frame) */
    FD = 72,        /* sizeof(struct canfd_frame) */
    HEAD = 8,
    FILTERS = 64 /* identifiers at most; of more, all messages come */
};

static bool is_set(int handle, int level, int option, const void *value, size_t size)
{
    return setsockopt(handle, level, option, value, (socklen_t)size) == 0;
}

static bool is_made_nonblocking(int handle)
{
    int flags = fcntl(handle, F_GETFL);
    return flags >= 0 && fcntl(handle, F_SETFL, flags | O_NONBLOCK) == 0;
}

/* Set the address of `239.74.163.2:43113`. */
static bool find_address(const char *text, struct sockaddr_in *address)
{
    const char *colon = strrchr(text, ':');
    char group[INET_ADDRSTRLEN];
    size_t length = colon != NULL ? (size_t)(colon - text) : 0u;
    long port = colon != NULL ? strtol(colon + 1, NULL, 10) : 0;
    if (length == 0u || length >= sizeof group || port < 1 || port > 65535) {
        return false;
    }
    memcpy(group, text, length);
    group[length] = '\0';
    memset(address, 0, sizeof *address);
    address->sin_family = AF_INET;
    address->sin_port = htons((uint16_t)port);
    return inet_pton(AF_INET, group, &address->sin_addr) == 1 &&
           (ntohl(address->sin_addr.s_addr) >> 28u) == 0xeu;
}

static bool is_udp_opened(fsm_can_bus *bus, const struct sockaddr_in *address)
{
    const int yes = 1;
    const unsigned char hops = 0u; /* it does not leave this computer */
    struct ip_mreq join;
    join.imr_multiaddr = address->sin_addr;
    join.imr_interface.s_addr = htonl(INADDR_LOOPBACK);
    bus->in = socket(AF_INET, SOCK_DGRAM, 0);
    bus->out = socket(AF_INET, SOCK_DGRAM, 0);
    return bus->in >= 0 && bus->out >= 0 &&
           is_set(bus->in, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) &&
           bind(bus->in, (const struct sockaddr *)(const void *)address, sizeof *address) == 0 &&
           is_set(bus->in, IPPROTO_IP, IP_ADD_MEMBERSHIP, &join, sizeof join) &&
           is_set(bus->out, IPPROTO_IP, IP_MULTICAST_IF, &join.imr_interface,
                  sizeof join.imr_interface) &&
           is_set(bus->out, IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof hops) &&
           connect(bus->out, (const struct sockaddr *)(const void *)address, sizeof *address) == 0 &&
           is_made_nonblocking(bus->in) && is_made_nonblocking(bus->out);
}

#ifdef __linux__
static bool is_can_opened(fsm_can_bus *bus, const char *name, const fsm_can_message *wanted,
                          unsigned count)
{
    const int yes = 1;
    const can_err_mask_t errors = CAN_ERR_MASK;
    struct can_filter filters[FILTERS];
    struct sockaddr_can address;
    memset(&address, 0, sizeof address);
    memset(filters, 0, sizeof filters); /* a mask of 0 is fulfilled by each */
    for (unsigned place = 0u; place < count && count <= FILTERS; place++) {
        bool is_extended = (wanted[place].id & FSM_CAN_EXTENDED) != 0u;
        filters[place].can_id = wanted[place].id;
        filters[place].can_mask = CAN_EFF_FLAG | CAN_RTR_FLAG;
        filters[place].can_mask |= is_extended ? CAN_EFF_MASK : CAN_SFF_MASK;
    }
    address.can_family = AF_CAN;
    address.can_ifindex = (int)if_nametoindex(name);
    if (address.can_ifindex == 0) {
        return false;
    }
    bus->in = bus->out = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    return bus->in >= 0 &&
           is_set(bus->in, SOL_CAN_RAW, CAN_RAW_FILTER, filters,
                  (count <= FILTERS ? count : 1u) * sizeof *filters) &&
           is_set(bus->in, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) &&
           is_set(bus->in, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &yes, sizeof yes) &&
           bind(bus->in, (const struct sockaddr *)(const void *)&address, sizeof address) == 0 &&
           is_made_nonblocking(bus->in);
}
#else
static bool is_can_opened(fsm_can_bus *bus, const char *name, const fsm_can_message *wanted,
                          unsigned count)
{
    (void)bus, (void)name, (void)wanted, (void)count;
    errno = ENOTSUP;
    return false;
}
#endif

int fsm_can_bus_open(fsm_can_bus *bus, const char *name, const fsm_can_message *wanted,
                     unsigned count)
{
    struct sockaddr_in address;
    bool is_opened;
    int error;
    bus->in = bus->out = -1;
    if (strncmp(name, "udp:", 4u) == 0) {
        if (!find_address(name + 4, &address)) {
            return EINVAL;
        }
        is_opened = is_udp_opened(bus, &address);
    } else {
        is_opened = is_can_opened(bus, name, wanted, count);
    }
    error = errno;
    if (is_opened) {
        return 0;
    }
    fsm_can_bus_close(bus);
    return error;
}

bool fsm_can_bus_send(const fsm_can_bus *bus, const fsm_can_frame *frame, bool is_fd)
{
    size_t size = is_fd ? FD : CLASSICAL;
    return send(bus->out, frame, size, 0) == (ssize_t)size;
}

bool fsm_can_bus_receive(const fsm_can_bus *bus, fsm_can_frame *frame)
{
    for (;;) {
        ssize_t size = recv(bus->in, frame, sizeof *frame, 0);
        if (size < 0 && errno == EINTR) {
            continue;
        }
        if (size < 0) {
            return false;
        }
        if ((size == CLASSICAL || size == FD) && frame->length <= size - HEAD) {
            return true;
        }
    }
}

void fsm_can_bus_close(fsm_can_bus *bus)
{
    if (bus->in >= 0) {
        (void)close(bus->in);
    }
    if (bus->out >= 0 && bus->out != bus->in) {
        (void)close(bus->out);
    }
    bus->in = bus->out = -1;
}
