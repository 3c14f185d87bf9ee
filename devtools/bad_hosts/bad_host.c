/* bad_host.c: any generated machine in the hands of a host that breaks its contract.
 *
 * The host posts numbers that are no events, lets the clock jump and wrap, fills queues, restores
 * damaged snapshots and those of other charts, and calls every function from within operations. In a
 * build with FSM_CHECKED payloads are any bytes. After each call the laws below must hold; the
 * sanitizers end the program at an error of memory. It prints a digest of all that it was answered
 * and of all snapshots, which must be the same for each form of a chart.
 *
 *   bad_host CALLS SEED KIND      KIND: 0 values of inputs, payloads and results are of their
 *                                 types; 1 they are any values (no digest, fewer laws) */
#include "bad_host.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const subject *current;
static bool is_within, beyond;
static uint32_t now;
static bool went_back; /* far, since the start: deadlines must stay less than 2^31 ticks apart */
static uint64_t chance_state, digest;
static unsigned long calls, depth;
static uint8_t *copy; /* of the machine, to compare */
static uint64_t counts[8];
enum { OF_POSTS, OF_FULL, OF_UNKNOWN, OF_REFUSED, OF_WITHIN, OF_RESTORED, OF_REJECTED, OF_STOPPED };

static uint32_t below(uint32_t limit) /* xorshift64*, after Vigna */
{
    chance_state ^= chance_state >> 12;
    chance_state ^= chance_state << 25;
    chance_state ^= chance_state >> 27;
    return (uint32_t)((chance_state * UINT64_C(2685821657736338717)) >> 32) % limit;
}

static uint64_t any_bits(void)
{
    return (uint64_t)below(UINT32_MAX) << 32 | below(UINT32_MAX);
}

static void note(uint64_t value)
{
    for (unsigned shift = 0; shift < 64; shift += 8) /* FNV-1a */
        digest = (digest ^ (value >> shift & 255u)) * UINT64_C(1099511628211);
}

/* Any bytes, by one number drawn: structs of two forms differ in size. */
static void fill(void *memory, size_t size)
{
    uint32_t state = below(UINT32_MAX);
    for (size_t i = 0; i < size; i++) {
        state = 1664525u * state + 1013904223u;
        ((unsigned char *)memory)[i] = (unsigned char)(state >> 24);
    }
}

#define LAW(holds)                                                                                 \
    do {                                                                                           \
        if (!(holds)) {                                                                            \
            fprintf(stderr, "%s, call %lu: broken at line %d: %s\n", current->name, calls,         \
                    __LINE__, #holds);                                                             \
            exit(1);                                                                               \
        }                                                                                          \
    } while (0)

/* ---- values ------------------------------------------------------------------------------------ */

/* A value of a type; with `is_any` often outside of the type. A bool of other bytes only in an event. */
static void draw(const fsm_type *type, void *place, bool is_any, bool any_bool)
{
    static const double odd[] = {0.0, -0.0, 0.5, -1e300, 1e300, 9.3e18, -9.3e18, 4.3e9};
    for (uint32_t k = 0; k < type->scalars; k++) {
        uint32_t offset = 0;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        void *at = fsm_place_at(place, offset);
        const uint64_t span = scalar->hi - scalar->lo;
        const uint32_t kind = below(8);
        uint64_t bits;
        if (scalar->kind == FSM_FLOAT) {
            const double zero = 0.0;
            fsm_set_float(scalar, at, kind == 0 ? zero / zero : kind == 1 ? 1.0 / zero
                                      : kind < 5 ? odd[below(8)] : (double)below(2001) / 8.0 - 99);
            continue;
        }
        if (scalar->kind == FSM_ENUMERATION && scalar->numbers != NULL)
            bits = (uint64_t)(int64_t)scalar->numbers[below(scalar->count)];
        else if (kind < 3)
            bits = kind == 0 ? scalar->lo : kind == 1 ? scalar->hi : scalar->lo + span / 2;
        else
            bits = span == UINT64_MAX ? any_bits() : scalar->lo + any_bits() % (span + 1u);
        if (is_any && below(3) == 0 && (any_bool || scalar->kind != FSM_BOOL))
            bits = kind < 2 ? scalar->lo - 1u : kind < 4 ? scalar->hi + 1u : any_bits();
        if (scalar->kind == FSM_DURATION && !is_any && kind > 3)
            bits %= 1000u;
        fsm_set_bits(scalar, at, bits);
    }
}

static bool is_of(const fsm_type *type, const void *place)
{
    for (uint32_t k = 0; k < type->scalars; k++) {
        uint32_t offset = 0;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        if (!fsm_is_of(scalar, fsm_bits_at(scalar, fsm_at(place, offset))))
            return false;
    }
    return true;
}

/* Whether an event is known, and its payload of its types. */
static bool is_sound(const fsm_machine_info *info, const void *e)
{
    const uint32_t number = fsm_event_of(info, e);
    if (number == 0 || number > info->event_count)
        return false;
    const fsm_event_info *event = &info->events[number - 1u];
    for (unsigned i = 0; i < event->field_count; i++)
        if (!is_of(event->fields[i].type, fsm_at(e, event->fields[i].offset)))
            return false;
    return true;
}

/* An event; often an unknown number, with any bytes. */
static void draw_event(const fsm_machine_info *info, void *e)
{
    uint32_t number = info->event_count == 0 ? 0 : 1u + below(info->event_count);
    for (unsigned tries = 0; tries < 8u && number > 0; tries++) {
        if ((info->events[number - 1u].flags & FSM_EVENT_IN) != 0)
            break;
        number = 1u + below(info->event_count);
    }
    memset(e, 0, info->event_size);
    if (below(8) == 0 || number == 0) {
        static const uint32_t odd[] = {0u, 0xFFu, 0x100u, 0xFFFFu, 0x10000u, 0xFFFFFFFFu};
        fill(e, info->event_size);
        number = below(3) == 0 ? info->event_count + 1u : below(2) == 0 ? number << 16 | number
                                                                        : odd[below(6)];
        fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, number);
        number = fsm_event_of(info, e);
        if (number == 0 || number > info->event_count) {
            counts[OF_UNKNOWN]++;
            return;
        }
        memset(e, 0, info->event_size); /* cut short to one that there is */
    }
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, number);
    const fsm_event_info *event = &info->events[number - 1u];
    for (unsigned i = 0; i < event->field_count; i++)
#ifdef FSM_CHECKED
        draw(event->fields[i].type, fsm_place_at(e, event->fields[i].offset), true, true);
#else
        draw(event->fields[i].type, fsm_place_at(e, event->fields[i].offset), beyond, false);
#endif
}

static void draw_inputs(const fsm_machine_info *info, void *m)
{
    const fsm_field *inputs = &info->variables[info->data_count + info->output_count];
    for (unsigned i = 0; i < info->input_count; i++)
        draw(inputs[i].type, fsm_place_at(m, inputs[i].offset), beyond, false);
}

/* ---- laws --------------------------------------------------------------------------------------- */

static unsigned held(const fsm_list_info *list, const void *m)
{
    return list->count == FSM_ABSENT ? 0u : *(const uint8_t *)fsm_at(m, list->count);
}

static void check_events(const fsm_machine_info *info, const void *m, const fsm_list_info *list)
{
    LAW(held(list, m) <= list->room);
#ifdef FSM_CHECKED
    for (unsigned i = 0; i < held(list, m); i++)
        LAW(beyond || is_sound(info, fsm_at(m, list->offset + i * info->event_size)));
#else
    (void)info;
#endif
}

/* What holds of a machine between calls. */
static void check_one(const fsm_machine_info *info, const void *m)
{
    for (unsigned i = 0; i < info->number_count; i++) {
        const uint32_t number = fsm_number_at(&info->numbers[i], m);
        LAW(number < info->state_count);
        LAW(number == 0 || info->states[number].region == info->numbers[i].region);
    }
    check_events(info, m, &info->queue);
    check_events(info, m, &info->deferred);
    LAW(held(&info->internal, m) == 0);
    LAW(held(&info->delayed, m) <= info->delayed.room);
    LAW(held(&info->timers, m) <= info->timers.room);
    LAW(info->busy == FSM_ABSENT || !*(const bool *)fsm_at(m, info->busy));
    LAW(info->fault == FSM_ABSENT || *(const uint8_t *)fsm_at(m, info->fault) <= FSM_FAULT_INVOKED);
    for (unsigned i = 0; i < (unsigned)info->data_count + info->output_count; i++)
        LAW(beyond || is_of(info->variables[i].type, fsm_at(m, info->variables[i].offset)));
}

static void check(const subject *s)
{
    const fsm_machine_info *info = s->driver->info;
    check_one(info, s->machine);
    for (unsigned i = 0; i < info->slot_count; i++) {
        const void *inner = fsm_at(s->machine, info->slots[i].offset);
        if (fsm_is_running(info->slots[i].info, inner))
            check_one(info->slots[i].info, inner);
    }
}

/* ---- what the host does ------------------------------------------------------------------------- */

static void damage(uint8_t *bytes, size_t size)
{
    for (unsigned n = 1u + below(4); n > 0; n--)
        bytes[below((uint32_t)size)] = (uint8_t)below(256);
}

/* The checksum of the bytes before it, as fsm_save writes it. */
static void seal(uint8_t *bytes, size_t size)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i + 4u < size; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8u; bit++)
            crc = (crc & 1u) != 0 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
    for (unsigned i = 0; i < 4u; i++)
        bytes[size - 4u + i] = (uint8_t)(~crc >> 8 * i & 255u);
}

/* Restore what is no snapshot of this machine, in a block of just its size. */
static fsm_restored restore_bad(const subject *s, void *m, uint32_t at)
{
    size_t size = s->saved_size;
    const uint32_t kind = below(6);
    fsm_restored found;
    if (kind == 0)
        size = below((uint32_t)size);
    else if (kind == 1)
        size += 1u + below(9);
    uint8_t *bytes = malloc(size + 1u);
    if (!s->driver->save(s->machine, at, s->again))
        memset(s->again, 0, s->saved_size);
    for (size_t i = 0; i < size; i++)
        bytes[i] = i < s->saved_size ? s->again[i] : (uint8_t)below(256);
    if (kind > 1 && size > 0)
        damage(bytes, size);
    if (kind == 3)
        bytes[4u + below(8)] ^= 1u; /* of another chart */
    if (kind != 4 && size > 4u)
        seal(bytes, size);
    found = s->driver->restore(m, at, bytes, size);
    free(bytes);
    return found;
}

/* Call what must change nothing within a step; then post. */
static void misbehave_alone(void)
{
    const subject *s = current;
    const fsm_driver *driver = s->driver;
    const size_t size = driver->info->size;
    uint32_t deadline;
    is_within = true;
    counts[OF_WITHIN]++;
    memcpy(copy, s->machine, size);
    draw_event(driver->info, s->inner);
    LAW(driver->dispatch(s->machine, s->inner, now + below(99)) == FSM_BUSY);
    driver->run(s->machine, now + below(1000));
    driver->start(s->machine, below(1000));
    LAW(!s->step(s->machine, below(3)));
    LAW(!driver->save(s->machine, now, s->again));
    LAW(driver->restore(s->machine, now, s->saved, s->saved_size) == FSM_IN_STEP);
    LAW(restore_bad(s, s->machine, now) == FSM_IN_STEP);
    (void)driver->next_deadline(s->machine, &deadline);
    s->read(s->machine, below(2) == 0 ? below(99) : below(UINT32_MAX));
    LAW(memcmp(copy, s->machine, size) == 0);
    for (uint32_t n = below(4); n > 0; n--) {
        draw_event(driver->info, s->inner);
        note(driver->post(s->machine, s->inner));
    }
    is_within = false;
}

static void (*misbehave)(void) = misbehave_alone; /* in an operation */

static void read_given(const fsm_field *fields, unsigned count, const void *const *given)
{
    for (unsigned i = 0; i < count; i++)
        for (uint32_t k = 0; k < fields[i].type->scalars; k++) {
            uint32_t offset = 0;
            const fsm_type *scalar = fsm_scalar(fields[i].type, k, &offset);
            const uint64_t bits = fsm_bits_at(scalar, fsm_at(given[i], offset));
            LAW(beyond || fsm_is_of(scalar, bits));
            if (scalar->kind != FSM_FLOAT && scalar->kind != FSM_SYMBOL)
                note(bits);
        }
}

void host_call(const fsm_machine_info *info, uint32_t operation, const void *const *given,
               void *result)
{
    const fsm_operation_info *of = &info->operations[operation];
    note(operation);
    read_given(of->parameters, of->parameter_count, given);
    if (!is_within && below(4) == 0)
        misbehave();
    if (of->result != NULL)
        draw(of->result, result, beyond, false);
}

void host_send(const fsm_machine_info *info, uint32_t event, const void *const *given)
{
    note(event);
    read_given(info->events[event].fields, info->events[event].field_count, given);
    if (!is_within && below(4) == 0)
        misbehave();
}

static bool is_running(void)
{
    return fsm_is_running(current->driver->info, current->machine);
}

static void go_back(void)
{
    if (below(2) == 0) {
        now -= below(1000);
    } else if (!went_back) {
        went_back = true;
        now -= below(UINT32_C(0x40000000));
    }
}

/* Time goes on by little, to the first deadline, far where nothing waits, or back. */
static void pass_time(void)
{
    uint32_t due = 0;
    const bool has_timer = current->driver->next_deadline(current->machine, &due);
    switch (below(16)) {
    case 0: go_back(); break;
    case 1: now = has_timer ? now + below(2000) : now + below(UINT32_C(0x7FFFFFFF)); break;
    case 2: case 3: case 4: now = has_timer && due - now < 100000u ? due + below(3) : now + 1u; break;
    default: now += below(200); break;
    }
}

/* A period that was missed fires once for each time: let that not be a million times. */
static void limit_lateness(void)
{
    uint32_t due = 0;
    if (current->driver->next_deadline(current->machine, &due) && now - due < 0x80000000u &&
        now - due > 2000u)
        now = due + below(2000);
}

static void dispatch(void)
{
    const subject *s = current;
    draw_event(s->driver->info, s->event);
    const bool sound = is_sound(s->driver->info, s->event);
    const bool runs = is_running();
    const fsm_result found = s->driver->dispatch(s->machine, s->event, now);
#ifdef FSM_CHECKED
    LAW((found == FSM_REFUSED) == !sound);
    counts[OF_REFUSED] += found == FSM_REFUSED;
    LAW(!sound || (found == FSM_STOPPED) == !runs);
#else
    const uint32_t number = fsm_event_of(s->driver->info, s->event);
    LAW((found == FSM_STOPPED) == !runs);
    LAW(found != FSM_HANDLED || (number > 0 && number <= s->driver->info->event_count));
    (void)sound;
#endif
    LAW(found != FSM_BUSY);
    counts[OF_STOPPED] += found == FSM_STOPPED;
    note(found);
}

static void post(void)
{
    const subject *s = current;
    const fsm_machine_info *info = s->driver->info;
    for (unsigned n = below(8) == 0 ? 300u : 1u + below(3); n > 0; n--) {
        draw_event(info, s->event);
        const unsigned before = held(&info->queue, s->machine);
        const bool has_room = before + held(&info->deferred, s->machine) < info->queue.room;
        const bool fits = s->driver->post(s->machine, s->event);
#ifdef FSM_CHECKED
        LAW(fits == (has_room && is_running() && is_sound(info, s->event)));
#else
        LAW(fits == (has_room && is_running()));
#endif
        LAW(held(&info->queue, s->machine) == before + (fits ? 1u : 0u));
        counts[OF_POSTS]++;
        counts[OF_FULL] += !fits;
        note(fits);
    }
}

/* What is saved is restored, and saved again as the same bytes. */
static void save(void)
{
    const subject *s = current;
    const fsm_driver *driver = s->driver;
    LAW(driver->save(s->machine, now, s->saved));
    for (size_t i = 0; i < s->saved_size; i++)
        note(s->saved[i]);
    memset(s->other, 0xA5, driver->info->size);
    driver->info->init(s->other);
    const uint32_t later = below(2) == 0 ? now : below(UINT32_MAX);
    const fsm_restored found = driver->restore(s->other, later, s->saved, s->saved_size);
    note(found);
    if (beyond)
        return;
    LAW(found == FSM_RESTORED);
    LAW(driver->save(s->other, later, s->again));
    LAW(memcmp(s->saved, s->again, s->saved_size) == 0);
    counts[OF_RESTORED]++;
    if (below(2) == 0) {
        memcpy(s->machine, s->other, driver->info->size);
        now = later;
    }
}

static void restore(void)
{
    const subject *s = current;
    const fsm_restored found = restore_bad(s, s->machine, now);
    LAW(found != FSM_IN_STEP);
    note(found);
    if (found == FSM_RESTORED) { /* a machine that could be */
        LAW(s->driver->save(s->machine, now, s->again));
    } else {
        counts[OF_REJECTED]++;
    }
}

static void start(void)
{
    const fsm_driver *driver = current->driver;
    if (below(4) == 0) {
        fill(current->machine, driver->info->size); /* init accepts a machine of any bytes */
        driver->info->init(current->machine);
    }
    now = below(4) == 0 ? 0u - below(300) : below(4) == 0 ? 0x80000000u - below(300) : now;
    went_back = false;
    draw_inputs(driver->info, current->machine);
    driver->start(current->machine, now);
}

static void abuse(const subject *s, unsigned long many, uint64_t seed)
{
    uint32_t deadline;
    current = s;
    chance_state = seed * 2u + 1u;
    for (unsigned n = 0; n < 20; n++)
        (void)below(2); /* a small seed takes a while to spread */
    digest = UINT64_C(14695981039346656037);
    copy = realloc(copy, s->driver->info->size);
    now = 0;
    went_back = false;
    memset(s->machine, 0x5A, s->driver->info->size);
    s->driver->info->init(s->machine);
    check(s);
    (void)s->driver->save(s->machine, now, s->saved);
    for (calls = 0; calls < many; calls++) {
        if (below(is_running() ? 200 : 3) == 0)
            start();
        else switch (below(12)) {
        case 0: case 1: pass_time(); limit_lateness(); s->driver->run(s->machine, now); break;
        case 2: pass_time(); dispatch(); break;
        case 3: case 4: post(); limit_lateness(); s->driver->run(s->machine, now); break;
        case 5: post(); draw_inputs(s->driver->info, s->machine); break;
        case 6: note(s->step(s->machine, below(3))); break;
        case 7: s->read(s->machine, below(2) == 0 ? below(99) : below(UINT32_MAX)); break;
        case 8: if (below(4) == 0) save(); break;
        case 9: if (below(8) == 0) restore(); break;
        case 10: note(s->driver->next_deadline(s->machine, &deadline)); break;
        default: dispatch(); break;
        }
        check(s);
    }
    printf("%s %016" PRIx64, s->name, digest);
    for (unsigned i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        printf(" %" PRIu64, counts[i]);
        counts[i] = 0;
    }
    printf("\n");
}
