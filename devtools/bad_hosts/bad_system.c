/* bad_system.c: joined machines in the hands of a host that breaks its contract; see bad_host.c.
 *
 *   bad_system CALLS SEED */
#include "bad_host.c"

typedef struct {
    void *system;
    size_t size;
    void (*init)(void *s);
    bool (*start)(void *s, uint32_t now);
    bool (*run)(void *s, uint32_t now);
    bool (*next_deadline)(const void *s, uint32_t *deadline);
    void (*rests)(const void *s); /* what holds between calls */
    const subject *members;
    unsigned count;
} joined;

static const joined *whole;

static void choose(void)
{
    current = &whole->members[below(whole->count)];
}

/* Within a step: call what must change nothing, then what each machine allows. */
static void misbehave_joined(void)
{
    const subject *outer = current;
    uint32_t due;
    is_within = true;
    counts[OF_WITHIN]++;
    memcpy(copy, whole->system, whole->size);
    LAW(!whole->run(whole->system, now + below(1000)));
    LAW(!whole->start(whole->system, below(1000)));
    (void)whole->next_deadline(whole->system, &due);
    LAW(memcmp(copy, whole->system, whole->size) == 0);
    for (uint32_t n = below(4); n > 0; n--) {
        choose();
        draw_event(current->driver->info, current->inner);
        (void)current->driver->post(current->machine, current->inner);
        current->read(current->machine, below(99));
    }
    current = outer;
    is_within = false;
}

static void check_joined(void)
{
    whole->rests(whole->system);
    for (unsigned i = 0; i < whole->count; i++) {
        current = &whole->members[i];
        check(current);
    }
}

static void abuse_joined(const joined *of, unsigned long many, uint64_t seed)
{
    uint32_t due;
    whole = of;
    misbehave = misbehave_joined;
    chance_state = seed * 2u + 1u;
    copy = realloc(copy, of->size);
    fill(of->system, of->size);
    of->init(of->system);
    for (calls = 0; calls < many; calls++) {
        choose();
        draw_inputs(current->driver->info, current->machine);
        switch (calls == 0 ? 0 : below(16)) {
        case 0:
            if (below(8) == 0) {
                fill(of->system, of->size); /* init accepts any bytes */
                of->init(of->system);
                check_joined();
            }
            now = below(2) == 0 ? 0u - below(3000) : below(UINT32_MAX);
            went_back = false;
            (void)of->start(of->system, now);
            break;
        case 1: case 2: case 3: case 4: case 5: post(); break;
        case 6: go_back(); break;
        case 7: now += below(30000); break;
        case 8: (void)of->next_deadline(of->system, &due); break;
        case 9: current->read(current->machine, below(99)); break;
        case 10: LAW(current->driver->save(current->machine, now, current->saved)); break;
        default:
            now += below(2000);
            if (of->next_deadline(of->system, &due) && now - due < 0x80000000u && now - due > 5000u)
                now = due + below(5000);
            (void)of->run(of->system, now);
            break;
        }
        check_joined();
    }
    printf("%lu calls", calls);
    for (unsigned i = 0; i < sizeof counts / sizeof counts[0]; i++)
        printf(" %" PRIu64, counts[i]);
    printf("\n");
}
