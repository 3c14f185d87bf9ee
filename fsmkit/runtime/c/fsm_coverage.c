/* See fsm_coverage.h. */
#include "fsm_coverage.h"

static uint16_t fsm_coverage_put(uint16_t check, const uint8_t *bytes, size_t count, fsm_write write, void *arg)
{
    for (size_t i = 0u; i < count; i++) {
        check = (uint16_t)(check ^ (uint16_t)((uint16_t)bytes[i] << 8));
        for (int bit = 0; bit < 8; bit++) {
            check = (uint16_t)((check & 0x8000u) != 0u ? ((uint32_t)check << 1) ^ 0x1021u : (uint32_t)check << 1);
        }
    }
    write(arg, bytes, count);
    return check;
}

void fsm_coverage_write(
    const uint8_t fingerprint[8], const uint8_t *counters, uint32_t count, fsm_write write, void *arg)
{
    uint8_t head[17] = {0x46u, 0x53u, 0x4Du, 0x43u, 1u};
    for (size_t i = 0u; i < 8u; i++) {
        head[5u + i] = fingerprint[i];
    }
    for (size_t i = 0u; i < 4u; i++) {
        head[13u + i] = (uint8_t)((count >> (8u * i)) & 0xFFu);
    }
    uint16_t check = fsm_coverage_put(0xFFFFu, head, sizeof head, write, arg);
    check = fsm_coverage_put(check, counters, count, write, arg);
    uint8_t end[2];
    end[0] = (uint8_t)(check >> 8);
    end[1] = (uint8_t)(check & 0xFFu);
    write(arg, end, sizeof end);
}
