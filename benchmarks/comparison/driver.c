/* Runs a machine through a stream of events.
 *   driver EVENTS verify      the digests of the work done
 *   driver EVENTS run TIMES   the stream so many times, for a counter of instructions
 * bench_chart.h, written for each machine, defines its names. An empty machine runs in the same loop,
 * so that the instructions of the loop can be subtracted. */
#include "bench_chart.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef COUNT
#define COUNT 1000000u
#endif

static uint8_t stream[COUNT];
static BENCH_EVENT events[COUNT];
static BENCH_MACHINE machine;
uint32_t bench_order;

static uint32_t mixed(uint32_t digest, uint32_t value)
{
    return (digest ^ value) * 16777619u;
}

static int read_events(const char *path)
{
    static const uint32_t numbers[] = {BENCH_NUMBERS};
    FILE *file = fopen(path, "rb");
    size_t count = file ? fread(stream, 1, COUNT, file) : 0;
    if (file)
        fclose(file);
    for (size_t i = 0; i < count; i++) {
        if (stream[i] >= sizeof numbers / sizeof *numbers)
            return 0;
        BENCH_SET(events[i], numbers[stream[i]]);
    }
    return count == COUNT;
}

static void begin(void)
{
    bench_order = 0;
    BENCH_INIT;
    BENCH_START;
}

#ifdef BENCH_VERIFY
void bench_entered(unsigned state)
{
    static const uint8_t codes[] = {BENCH_CODES};
    if (state < sizeof codes && codes[state])
        bench_order = bench_order * 31u + (uint32_t)(codes[state] - 1u) * 2u;
}

void bench_exited(unsigned state)
{
    static const uint8_t codes[] = {BENCH_CODES};
    if (state < sizeof codes && codes[state])
        bench_order = bench_order * 31u + (uint32_t)(codes[state] - 1u) * 2u + 1u;
}

static void verify(void)
{
    uint32_t path = 2166136261u;
    uint32_t work = 2166136261u;
    begin();
    for (uint32_t i = 0; i < COUNT; i++) {
        BENCH_DISPATCH(i);
        path = mixed(path, (uint32_t)machine.data.n & 0xffu);
    }
    const uint32_t data[] = {BENCH_DATA};
    for (size_t i = 0; i < sizeof data / sizeof *data; i++)
        work = mixed(work, data[i]);
    printf("%08x %08x %08x\n", (unsigned)work, (unsigned)path, (unsigned)bench_order);
}
#endif

int main(int count, char **arguments)
{
    if (count < 3 || !read_events(arguments[1]))
        return 2;
#ifdef BENCH_VERIFY
    if (strcmp(arguments[2], "verify") == 0) {
        verify();
        return 0;
    }
#endif
    begin();
    for (int times = count > 3 ? atoi(arguments[3]) : 1; times > 0; times--)
        for (uint32_t i = 0; i < COUNT; i++)
            BENCH_DISPATCH(i);
    return 0;
}
