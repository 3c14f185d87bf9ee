/* Two cycles: one with good values, one with values out of range. */
#include <stdio.h>
#include <string.h>
#include "wide_bind.h"
#include "wide_host.h"
static wide machine;
static struct host host;
int host_count;
struct host *host_of(struct wide *m) { return m == &machine ? &host : NULL; }
void host_put(struct host *h, const struct host_pair *pair, uint8_t n, uint8_t value, uint8_t last)
{
    h->put = *pair;
    printf("put %u %d %u %d %u %u %.1f %d, %u %u %u\n", pair->bits.a, pair->b, pair->bits.c,
           (int)pair->mode, pair->bytes[0], pair->bytes[1], (double)pair->f, pair->more, n, value,
           last);
}
void host_gone(uint8_t ctx, uint8_t mode) { host.gone = ctx * 10 + mode; }
static void cycle(uint32_t now)
{
    wide_post_go(&machine);
    const unsigned rejected = wide_cycle(&machine, now);
    printf("%u %u: %d %llu %lld %.2f %.2f %d %d %lu %d%d%d %d%d"
           " | %d %.1f %d %u%u%u %d %d | %d %d %d\n",
           rejected, machine.fsm.rejected, machine.in.i8, (unsigned long long)machine.in.u64,
           (long long)machine.in.i64, (double)machine.in.f32, machine.in.f64, machine.in.flag,
           machine.in.mode, (unsigned long)machine.in.span, machine.in.table[0],
           machine.in.table[1], machine.in.table[2], machine.in.modes[0], machine.in.modes[1],
           host.o8, (double)host.of, (int)host.om, host.ot[0], host.ot[1], host.ot[2],
           (int)host.op.bits.a, host.ob, machine.data.seen, machine.data.how, host.gone);
}
int main(void)
{
    const struct host good = {
        .i8 = 42, .weight = 100, .u64 = UINT64_MAX, .i64 = INT64_MIN, .f32 = 1.5f, .f64 = 2.25,
        .measured = 3.5, .flags = 3, .mode = HOST_FAST, .answer = HOST_SLOW, .span = 77,
        .table = {1, 2, 3}, .modes = {HOST_SLOW, HOST_FAST},
        .pair = {{1000, 1}, -3, HOST_SLOW, {8, 9}, 0.5f, 6}};
    const double zero = host_count;
    host = good;
    wide_init(&machine);
    wide_start(&machine, 0u);
    cycle(1u);
    host.i8 = 1000;                              /* 100 */
    host.f32 = (float)(1.0 / zero);              /* the old value */
    host.f64 = zero / zero;                      /* the old value */
    host.mode = HOST_BROKEN;                     /* the old value */
    host.span = 4000000000u;                     /* 2^31 - 1 */
    host.table[1] = -1;                          /* 0 */
    host.modes[0] = (enum host_mode)9;           /* the old value */
    host.pair.bits.a = 1001;                     /* 1000 */
    host.weight = -100;                          /* 0, of an operation: counted by the machine */
    host.answer = HOST_BROKEN;                   /* the first member */
    cycle(2u);
    return 0;
}
