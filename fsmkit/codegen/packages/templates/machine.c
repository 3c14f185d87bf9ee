#include "@{prefix}.h"

static @{prefix} @{machine};

/* The time in ticks, modulo 2^32. */
static uint32_t now(void)
{
    static uint32_t before, count, rest; /* in us, in ticks, in us */
    const uint32_t value = @{microseconds};
    rest += value - before;
    before = value;
    count += rest / @{upper}_TICK_US;
    rest %= @{upper}_TICK_US;
    return count;
}
