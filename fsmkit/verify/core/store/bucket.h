/* bucket.h: the buckets of a hashed shard (shard.h): a cache line of slots, of which the first ones are taken.
 *
 * A slot holds a number of which the last bit is set; an empty one is 0. There are 16 slots of 32 bits, or 32 of 16. */
#ifndef FSM_BUCKET_H
#define FSM_BUCKET_H

#include <stdint.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

enum {
    FSM_BUCKET = 64, /* bytes */
    FSM_WIDE = 16,   /* slots in a bucket */
    FSM_NARROW = 32
};

static inline uint32_t fsm_bucket_slot(const void *bucket, unsigned slots, unsigned at)
{
    return slots == FSM_NARROW ? ((const uint16_t *)bucket)[at] : ((const uint32_t *)bucket)[at];
}

static inline void fsm_bucket_set(void *bucket, unsigned slots, unsigned at, uint32_t number)
{
    if (slots == FSM_NARROW)
        ((uint16_t *)bucket)[at] = (uint16_t)number;
    else
        ((uint32_t *)bucket)[at] = number;
}

/* A bit for each slot that holds a number. */
static inline uint32_t fsm_bucket_equal(const void *bucket, unsigned slots, uint32_t number)
{
#if defined(__SSE2__)
    const __m128i *quarters = bucket;
    __m128i wanted = slots == FSM_NARROW ? _mm_set1_epi16((short)number) : _mm_set1_epi32((int)number), same[4];
    for (int i = 0; i < 4; i++)
        same[i] = slots == FSM_NARROW ? _mm_cmpeq_epi16(_mm_load_si128(&quarters[i]), wanted)
                                      : _mm_cmpeq_epi32(_mm_load_si128(&quarters[i]), wanted);
    if (slots == FSM_NARROW)
        return (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(same[0], same[1]))
            | (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(same[2], same[3])) << 16;
    return (uint32_t)_mm_movemask_epi8(
        _mm_packs_epi16(_mm_packs_epi32(same[0], same[1]), _mm_packs_epi32(same[2], same[3])));
#else
    uint32_t found = 0;
    for (unsigned i = 0; i < slots; i++)
        found |= (uint32_t)(fsm_bucket_slot(bucket, slots, i) == number) << i;
    return found;
#endif
}

/* The first slot that holds a number, or as many as there are. */
static inline unsigned fsm_bucket_find(const void *bucket, unsigned slots, uint32_t number)
{
    uint32_t found = fsm_bucket_equal(bucket, slots, number);
    return found == 0 ? slots : (unsigned)__builtin_ctz(found);
}

/* Returns the number of used slots. */
static inline unsigned fsm_bucket_taken(const void *bucket, unsigned slots)
{
    return fsm_bucket_find(bucket, slots, 0);
}

#endif
