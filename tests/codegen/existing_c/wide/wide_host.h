/* A host of all types. */
#ifndef WIDE_HOST_H
#define WIDE_HOST_H
#include <stdint.h>
#include <stdbool.h>
#define HOST_LOW (-5)
#define HOST_LONG 2000UL
#define HOST_YES 1
#define HOST_BIG UINT64_MAX
enum host_mode { HOST_OFF, HOST_SLOW, HOST_FAST, HOST_BROKEN };
struct host_pair {
    struct { unsigned a : 10; unsigned c : 1; } bits;
    int8_t b;
    enum host_mode mode;
    uint8_t bytes[2];
    float f;
    int more;
};
struct host {
    int32_t i8, weight;
    uint64_t u64;
    int64_t i64;
    float f32;
    double f64, measured;
    uint8_t flags;
    enum host_mode mode, answer, om;
    uint32_t span;
    int table[3];
    enum host_mode modes[2];
    struct host_pair pair, op, put;
    int8_t o8;
    float of;
    uint16_t ot[3];
    bool ob;
    int gone;
};
extern int host_count;
struct wide;
struct host *host_of(struct wide *m);
void host_put(struct host *host, const struct host_pair *pair, uint8_t n, uint8_t value, uint8_t last);
void host_gone(uint8_t ctx, uint8_t mode);
#endif
