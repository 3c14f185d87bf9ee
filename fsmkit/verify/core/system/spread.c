#include "system/spread.h"

#include "system/system_model.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_STATES = 1 << 14,
    MOST_VALUES = 1 << 20 /* states times parts: some hundredths of a second */
};

/* Numbers that are never removed; 0: no number. */
typedef struct {
    uint64_t *slots;
    uint32_t capacity, count; /* a power of two, more than twice what comes */
} number_set;

static void clear(number_set *self)
{
    memset(self->slots, 0, self->capacity * sizeof *self->slots);
    self->count = 0;
}

static void add(number_set *self, uint64_t number)
{
    uint32_t at = (uint32_t)number & (self->capacity - 1);
    number += number == 0;
    while (self->slots[at] != 0 && self->slots[at] != number)
        at = (at + 1) & (self->capacity - 1);
    self->count += self->slots[at] == 0;
    self->slots[at] = number;
}

/* Hash of bytes at a place; sums of it represent sets of places. FNV-1a, stirred as in MurmurHash3. */
static uint64_t hash(const unsigned char *state, size_t offset, size_t size)
{
    uint64_t found = 14695981039346656037u ^ offset;
    for (size_t i = offset; i < offset + size; i++)
        found = (found ^ state[i]) * 1099511628211u;
    found = (found ^ found >> 33) * 0xff51afd7ed558ccdu;
    found = (found ^ found >> 33) * 0xc4ceb9fe1a85ec53u;
    return found ^ found >> 33;
}

static uint64_t hash_part(const fsm_machine *m, uint32_t part, const unsigned char *state)
{
    uint64_t found = 0;
    for (uint32_t i = 0; i < m->span_count; i++)
        if (m->spans[i].part == part)
            found += hash(state, m->spans[i].offset, m->spans[i].size);
    return found;
}

/* Spans are in the order of their offsets; bytes between them belong to no part. */
static uint64_t hash_whole(const fsm_machine *m, const unsigned char *state)
{
    uint64_t found = 0;
    size_t from = 0;
    for (uint32_t i = 0; i < m->span_count; i++) {
        found += hash(state, from, m->spans[i].offset - from);
        found += hash(state, m->spans[i].offset, m->spans[i].size);
        from = m->spans[i].offset + m->spans[i].size;
    }
    return found + hash(state, from, m->info->size - from);
}

static int by_offset(const void *a, const void *b)
{
    size_t x = ((const fsm_span *)a)->offset, y = ((const fsm_span *)b)->offset;
    return (x > y) - (x < y);
}

static void print_parts(const fsm_composition *composition, uint32_t machine, const fsm_machine *m, uint32_t count,
                        uint64_t *wholes, number_set *values, number_set *others)
{
    for (uint32_t i = 0; i < count; i++)
        wholes[i] = hash_whole(m, fsm_local(composition, machine, i));
    for (uint32_t part = 0; part < m->part_count; part++) {
        clear(values);
        clear(others);
        for (uint32_t i = 0; i < count; i++) {
            uint64_t own = hash_part(m, part, fsm_local(composition, machine, i));
            add(values, own);
            add(others, wholes[i] - own);
        }
        printf("%s[%" PRIu32 ", %" PRIu32 "]", part == 0 ? "" : ", ", values->count, others->count);
    }
}

void fsm_print_spread(const fsm_composition *composition, uint32_t machine)
{
    fsm_machine m = *fsm_the_system.machines[machine];
    uint32_t count = fsm_local_count(composition, machine), capacity = 4;
    if (count > MOST_STATES)
        count = MOST_STATES;
    if (m.part_count > 0 && count > MOST_VALUES / m.part_count)
        count = MOST_VALUES / m.part_count;
    while (capacity < 2 * count)
        capacity *= 2;
    fsm_span *spans = malloc((m.span_count + 1u) * sizeof *spans);
    uint64_t *wholes = malloc((count + 1u) * sizeof *wholes);
    number_set values = {.slots = malloc(capacity * sizeof(uint64_t)), .capacity = capacity};
    number_set others = {.slots = malloc(capacity * sizeof(uint64_t)), .capacity = capacity};
    bool fine = spans != NULL && wholes != NULL && values.slots != NULL && others.slots != NULL;
    printf(", \"spread\": {\"states\": %" PRIu32 ", \"parts\": [", fine ? count : 0);
    if (fine) {
        memcpy(spans, m.spans, m.span_count * sizeof *spans);
        qsort(spans, m.span_count, sizeof *spans, by_offset);
        m.spans = spans;
        print_parts(composition, machine, &m, count, wholes, &values, &others);
    }
    printf("]}");
    free(spans);
    free(wholes);
    free(values.slots);
    free(others.slots);
}
