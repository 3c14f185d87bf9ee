/* fsm_test.c: tests of the library of generated machines. */
#include "fsm.h"

#include <stdio.h>
#include <string.h>

static int failures;

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            failures++;                                                                            \
            printf("line %d: %s\n", __LINE__, #condition);                                         \
        }                                                                                          \
    } while (0)

#define ROOM 6

static fsm_timer timers[ROOM];
static uint8_t count;

static void clear(void)
{
    memset(timers, 0, sizeof timers);
    count = 0;
}

static uint8_t insert(uint32_t deadline, uint16_t what)
{
    const fsm_timer timer = {deadline, what, 0u};
    return fsm_timers_insert(timers, &count, timer);
}

static void time_wraps_around(void)
{
    CHECK(fsm_reached(5u, 5u));
    CHECK(fsm_reached(6u, 5u));
    CHECK(!fsm_reached(4u, 5u));
    CHECK(fsm_reached(3u, 0xFFFFFFF0u));
    CHECK(!fsm_reached(0xFFFFFFF0u, 3u));
    CHECK(fsm_reached(0x7FFFFFFFu, 0u));
    CHECK(!fsm_reached(0x80000000u, 0u));
}

static void timers_are_sorted(void)
{
    clear();
    CHECK(insert(30u, 1u) == 0u);
    CHECK(insert(10u, 2u) == 0u);
    CHECK(insert(20u, 3u) == 1u);
    CHECK(insert(20u, 4u) == 2u); /* equal deadlines stay in the order of arming */
    CHECK(count == 4u);
    CHECK(timers[0].what == 2u && timers[1].what == 3u);
    CHECK(timers[2].what == 4u && timers[3].what == 1u);
}

static void timers_are_sorted_across_the_wrap(void)
{
    clear();
    (void)insert(5u, 1u);
    (void)insert(0xFFFFFFFEu, 2u);
    (void)insert(0u, 3u);
    CHECK(timers[0].what == 2u && timers[1].what == 3u && timers[2].what == 1u);
}

static void unused_timers_are_zero(void)
{
    static const fsm_timer zero[ROOM];
    clear();
    (void)insert(30u, 1u);
    (void)insert(10u, 2u);
    (void)insert(20u, 3u);
    fsm_timers_remove(timers, &count, 1u);
    CHECK(count == 2u && timers[0].what == 2u && timers[1].what == 1u);
    CHECK(memcmp(&timers[2], zero, sizeof(fsm_timer) * (ROOM - 2)) == 0);
    fsm_timers_disarm(timers, &count, 2u);
    CHECK(count == 1u && timers[0].what == 1u);
    fsm_timers_disarm(timers, &count, 9u); /* not armed: nothing happens */
    CHECK(count == 1u);
    fsm_timers_disarm(timers, &count, 1u);
    CHECK(count == 0u);
    CHECK(memcmp(timers, zero, sizeof timers) == 0);
}

static void all_places_can_be_used(void)
{
    uint8_t i;
    clear();
    for (i = 0u; i < ROOM; i++)
        (void)insert(100u - i, (uint16_t)(i + 1u));
    CHECK(count == ROOM);
    for (i = 0u; i < ROOM; i++)
        CHECK(timers[i].what == ROOM - i);
    for (i = 0u; i < ROOM; i++)
        fsm_timers_remove(timers, &count, 0u);
    CHECK(count == 0u);
}

static void first_of_timers(void)
{
    uint32_t deadline = 77u;
    clear();
    CHECK(!fsm_timers_first(timers, count, &deadline) && deadline == 77u);
    (void)insert(0x00000010u, 1u);
    (void)insert(0xFFFFFFF0u, 2u); /* time wraps around between them */
    CHECK(fsm_timers_first(timers, count, &deadline) && deadline == 0xFFFFFFF0u);
}

static void counters_and_memory(void)
{
    uint16_t counter = 65533u;
    fsm_count(&counter);
    CHECK(counter == 65534u);
    fsm_count(&counter);
    fsm_count(&counter);
    CHECK(counter == 65535u);
    uint8_t bytes[4] = {1u, 2u, 3u, 4u};
    fsm_clear(bytes, 3u);
    CHECK(bytes[0] == 0u && bytes[1] == 0u && bytes[2] == 0u && bytes[3] == 4u);
}

static void ranges_of_kind_fault(void)
{
    uint8_t failed = FSM_FINE;
    CHECK(fsm_within(&failed, -3, -3, 7) == -3 && fsm_within(&failed, 7, -3, 7) == 7);
    CHECK(fsm_within_u(&failed, false, UINT64_MAX, 1u, UINT64_MAX) == UINT64_MAX);
    CHECK(fsm_within_f(&failed, -2.9, -2, 7) == -2 && failed == FSM_FINE);
    CHECK(fsm_within(&failed, 8, -3, 7) == -3 && failed == FSM_RANGE_FAULT);
    failed = FSM_FINE;
    CHECK(fsm_within_u(&failed, true, UINT64_MAX, 1u, UINT64_MAX) == 1u);
    CHECK(failed == FSM_RANGE_FAULT);
    failed = FSM_FINE;
    CHECK(fsm_within_f(&failed, 8.0, -2, 7) == 7 && failed == FSM_RANGE_FAULT);
    failed = FSM_CONTENT_ERROR; /* the first failure is the one that counts */
    CHECK(fsm_within(&failed, 8, -3, 7) == -3 && failed == FSM_CONTENT_ERROR);
    CHECK(fsm_whole(8.5, -2, 7) == 7 && fsm_whole(-1.5, -2, 7) == -1);
}

static void division(void)
{
    uint8_t failed = FSM_FINE;
    CHECK(fsm_div_i32(&failed, -7, 2) == -3 && fsm_rem_i32(&failed, -7, 2) == -1);
    CHECK(fsm_div_i32(&failed, INT32_MIN, -1) == INT32_MIN);
    CHECK(fsm_rem_i32(&failed, INT32_MIN, -1) == 0);
    CHECK(fsm_div_i64(&failed, INT64_MIN, -1) == INT64_MIN);
    CHECK(fsm_rem_i64(&failed, INT64_MIN, -1) == 0);
    CHECK(fsm_div_u32(&failed, 7u, 2u) == 3u && fsm_rem_u64(&failed, 7u, 4u) == 3u);
    CHECK(failed == FSM_FINE);
    (void)fsm_div_i32(&failed, 1, 0);
    CHECK(failed == FSM_CONTENT_ERROR);
    failed = FSM_RANGE_FAULT; /* the first failure is the reported one */
    (void)fsm_rem_u32(&failed, 1u, 0u);
    CHECK(failed == FSM_RANGE_FAULT);
}

static void shifts_and_places(void)
{
    uint8_t failed = FSM_FINE;
    CHECK(fsm_asr_i32(-5, 1u) == -3 && fsm_asr_i32(5, 1u) == 2);
    CHECK(fsm_asr_i32(INT32_MIN, 31u) == -1);
    CHECK(fsm_asr_i64(INT64_MIN, 63u) == -1);
    CHECK(fsm_place(&failed, 3, 4u) == 3u && failed == FSM_FINE);
    CHECK(fsm_place(&failed, 4, 4u) == 0u && failed == FSM_CONTENT_ERROR);
    failed = FSM_FINE;
    CHECK(fsm_place(&failed, -1, 4u) == 0u && failed == FSM_CONTENT_ERROR);
}

static void wrapping(void)
{
    CHECK(fsm_wrap(4, 0, 3) == 0 && fsm_wrap(-1, 0, 3) == 3 && fsm_wrap(7, 0, 3) == 3);
    CHECK(fsm_wrap(6, -5, 5) == -5 && fsm_wrap(-6, -5, 5) == 5);
    CHECK(fsm_wrap(INT64_MIN, INT64_MIN, INT64_MAX) == INT64_MIN);
    CHECK(fsm_wrap(INT64_MAX, INT64_MIN, -1) == -1);
    CHECK(fsm_wrap(INT64_MIN, 0, INT64_MAX) == 0);
}

static void truncation(void)
{
    bool outside = true;
    const volatile double zero = 0.0;
    CHECK(fsm_truncate(2.9, 0, 5, &outside) == 2 && !outside);
    CHECK(fsm_truncate(-2.9, -5, 5, &outside) == -2 && !outside);
    CHECK(fsm_truncate(-0.9, 0, 5, &outside) == 0 && !outside);
    CHECK(fsm_truncate(6.0, 0, 5, &outside) == 5 && outside);
    CHECK(fsm_truncate(1e300, 0, 5, &outside) == 5 && outside);
    CHECK(fsm_truncate(-1e300, 0, 5, &outside) == 0 && outside);
    CHECK(fsm_truncate(1.0 / zero, INT64_MIN, INT64_MAX, &outside) == INT64_MAX && outside);
    CHECK(fsm_truncate(zero / zero, -5, 5, &outside) == 0 && !outside);
    CHECK(fsm_truncate(zero / zero, 3, 5, &outside) == 3 && outside);
}

int main(void)
{
    time_wraps_around();
    timers_are_sorted();
    timers_are_sorted_across_the_wrap();
    unused_timers_are_zero();
    all_places_can_be_used();
    first_of_timers();
    counters_and_memory();
    ranges_of_kind_fault();
    division();
    shifts_and_places();
    wrapping();
    truncation();
    return failures != 0;
}
