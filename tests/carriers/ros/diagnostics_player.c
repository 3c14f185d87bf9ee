/* diagnostics_player.c: a node whose machine stops by a fault when a line comes; test_c_carrier.py. */
#define _POSIX_C_SOURCE 200809L
#include "cell_b.h"
#include "fsm_dds_diagnostics.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static fsm_link wire;
static fsm_dds_diagnostics diagnostics;

int main(int argc, char **argv)
{
    static const char *const machines[] = {"camera", "belt"};
    struct pollfd in = {0, POLLIN, 0};
    char line[16];
    unsigned fault = 0u;
    fsm_dds_domain domain = {0u, false, 0};
    domain.id = argc == 2 ? (uint32_t)atoi(argv[1]) : 0u;
    fsm_link_init(&wire, &cell_b_map, 7u);
    if (argc != 2 || fsm_dds_diagnostics_open(&diagnostics, &wire, &domain, "Cell",
                                              machines, 2u) != 0)
        return 1;
    printf("ready\n");
    (void)fflush(stdout);
    for (;;) {
        fsm_link_begin(&wire);
        fsm_dds_diagnostics_note(&diagnostics, 0u, fault);
        fsm_link_end(&wire);
        if (poll(&in, 1u, 1) == 0)
            continue;
        if (fgets(line, sizeof line, stdin) == NULL)
            break;
        fault = 3u;
        fsm_dds_diagnostics_overran(&diagnostics, 5u);
        (void)fsm_link_arrive(&wire, CELL_B_NODE_VISION, (const uint8_t *)line, strlen(line));
    }
    fsm_dds_diagnostics_close(&diagnostics);
    return 0;
}
