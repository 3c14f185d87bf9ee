/* harness.c: a machine under a script, whatever machine it is: reads lines, writes the trace. */
#include "harness.h"

#include <ctype.h>
#include <stdlib.h>

#ifndef HARNESS_LONGEST /* bytes of a line; a small processor has less memory */
#define HARNESS_LONGEST 65536
#endif
#ifndef HARNESS_MADE /* symbols that the machine does not know, and bytes of each */
#define HARNESS_MADE 256
#endif
#ifndef HARNESS_PATH /* bytes of the names of slots in slots */
#define HARNESS_PATH 4096
#endif

static char pending[64]; /* the first line of a macrostep that may turn out to be none */
static char line[HARNESS_LONGEST];
static char *at = line;
static char made[HARNESS_MADE][HARNESS_MADE];
static unsigned made_count;
static uint32_t random_state = 1;
static bool after_bracket;
static struct { /* what the operation that is called as the last of so many posts */
    unsigned long calls;
    const watched *of;
    const fsm_driver *driver;
    void *machine;
    const void *event;
} within;

typedef struct results results;
struct results { /* of an operation: those of its `from` list, or those that a script gives */
    results *next;
    unsigned long count, at;
    bool is_listed;
    char *text; /* the name, then the values */
};
static results *all_results;

static uint32_t next_random(void)
{
    random_state = (1103515245u * random_state + 12345u) & 0x7fffffffu;
    return random_state;
}

static void seed_random(uint32_t seed)
{
    random_state = seed;
}

void wrong(const char *what)
{
    fprintf(stderr, "wrong script line: %s\n", what);
    exit(2);
}

static bool next_line(void)
{
    at = line;
    return fgets(line, sizeof line, stdin) != NULL && line[0] != '%';
}

static const char *read_text(void)
{
    char *word;
    while (*at != 0 && strchr(" [],", *at) != NULL) { /* brackets tell nothing that types do not */
        at++;
    }
    if (*at == '"') {
        word = ++at;
        while (*at != '"' && *at != 0) {
            at++;
        }
    } else {
        word = at;
        while (*at != 0 && strchr(" [],\n", *at) == NULL) {
            at++;
        }
    }
    if (*at != 0) {
        *at++ = 0;
    }
    return word;
}

static int64_t read_integer(void)
{
    const char *text = read_text();
    const bool is_negative = *text == '-';
    uint64_t value = 0;
    for (text += is_negative; *text >= '0' && *text <= '9'; text++) {
        value = 10u * value + (uint64_t)(*text - '0');
    }
    return (int64_t)(is_negative ? 0u - value : value);
}

static double read_float(void)
{
    return strtod(read_text(), NULL);
}

static bool read_bool(void)
{
    const char *text = read_text();
    return strncmp(text, "1", 1) == 0 || strncmp(text, "true", 4) == 0;
}

static int64_t read_member(const fsm_type *type)
{
    const char *text = read_text();
    for (unsigned i = 0; i < type->count; i++) {
        if (strcmp(type->members[i], text) == 0) {
            return type->numbers == NULL ? (int64_t)i : type->numbers[i];
        }
    }
    return strtol(text, NULL, 10);
}

/* Symbols that the machine does not know but a script or a host names. */
static const char *symbol_text(const fsm_machine_info *info, uint32_t symbol)
{
    return symbol >= UINT32_C(65536) - HARNESS_MADE && symbol < UINT32_C(65536) ? made[UINT32_C(65535) - symbol]
                                                                              : info->symbol(symbol);
}

static uint16_t find_symbol(const fsm_machine_info *info, const char *text)
{
    for (unsigned i = 0; i < info->symbol_count; i++) {
        if (strcmp(info->symbol(i), text) == 0) {
            return (uint16_t)i;
        }
    }
    for (unsigned i = 0; i < made_count; i++) {
        if (strcmp(made[i], text) == 0) {
            return (uint16_t)(65535u - i);
        }
    }
    if (made_count == HARNESS_MADE) {
        wrong("too many symbols");
    }
    snprintf(made[made_count], sizeof made[0], "%s", text);
    return (uint16_t)(65535u - made_count++);
}

/* ---- values ------------------------------------------------------------------------------------ */

static void space(void)
{
    if (!after_bracket) {
        putchar(' ');
    }
    after_bracket = false;
}

/* By hand: not every C library prints 64 bits. */
static void show_integer(bool negative, uint64_t value)
{
    char digits[20];
    unsigned count = 0;
    space();
    if (negative) {
        putchar('-');
        value = 0u - value;
    }
    do {
        digits[count++] = (char)('0' + (int)(value % 10u));
        value /= 10u;
    } while (value != 0);
    while (count > 0) {
        putchar(digits[--count]);
    }
}

static void show_float(double value)
{
    space();
    if (value != value) {
        printf("nan");
    } else {
        printf("%.17g", value);
    }
}

static void show_text(const char *text)
{
    space();
    printf("\"%s\"", text);
}

static void show_bracket(bool opening)
{
    if (opening) {
        space();
    }
    putchar(opening ? '[' : ']');
    after_bracket = opening;
}

static void show(const fsm_machine_info *info, const fsm_type *type, const void *value)
{
    switch (type->kind) {
    case FSM_ARRAY:
    case FSM_RECORD:
        show_bracket(true);
        for (uint32_t i = 0; i < type->count; i++) {
            if (type->kind == FSM_ARRAY) {
                show(info, type->element, fsm_at(value, i * type->element->size));
            } else {
                show(info, type->fields[i].type, fsm_at(value, type->fields[i].offset));
            }
        }
        show_bracket(false);
        break;
    case FSM_FLOAT:
        show_float(fsm_float_at(type, value));
        break;
    case FSM_SYMBOL:
        show_text(symbol_text(info, (uint32_t)fsm_bits_at(type, value)));
        break;
    default: {
        const uint64_t bits = fsm_bits_at(type, value);
        show_integer(fsm_is_signed(type) && bits >> 63 != 0, bits);
        break;
    }
    }
}

static void show_event(const fsm_machine_info *info, const void *e)
{
    const uint32_t number = fsm_event_of(info, e);
    if (number == 0 || number > info->event_count) {
        return;
    }
    const fsm_event_info *event = &info->events[number - 1];
    printf("%s", event->name);
    for (unsigned i = 0; i < event->field_count; i++) {
        show(info, event->fields[i].type, fsm_at(e, event->fields[i].offset));
    }
}

/* The next pseudo-random value of a type, as `SeededHost` makes it. */
static void make(const fsm_type *type, void *value)
{
    static const uint64_t largest = UINT64_C(1) << 22;
    for (uint32_t k = 0; k < type->scalars; k++) {
        uint32_t offset = 0;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        void *place = fsm_place_at(value, offset);
        const uint32_t drawn = next_random();
        const uint64_t span = scalar->hi - scalar->lo;
        switch (scalar->kind) {
        case FSM_BOOL:
            fsm_set_bits(scalar, place, drawn >> 16 & 1);
            break;
        case FSM_DURATION:
            fsm_set_bits(scalar, place, (drawn >> 8) % 1001);
            break;
        case FSM_FLOAT:
            fsm_set_float(scalar, place, ((double)((drawn >> 8) % 2001) - 1000.0) / 8.0);
            break;
        case FSM_SYMBOL:
            fsm_set_bits(scalar, place, 0);
            break;
        case FSM_ENUMERATION: {
            const uint32_t at = (drawn >> 8) % scalar->count;
            const int64_t number = scalar->numbers == NULL ? (int64_t)at : scalar->numbers[at];
            fsm_set_bits(scalar, place, (uint64_t)number);
            break;
        }
        default: {
            const uint64_t size = span < largest ? span + 1 : largest;
            fsm_set_bits(scalar, place, scalar->lo + (drawn >> 8) % size);
            break;
        }
        }
    }
}

static void read_value(const fsm_machine_info *info, const fsm_type *type, void *value)
{
    for (uint32_t k = 0; k < type->scalars; k++) {
        uint32_t offset = 0;
        const fsm_type *scalar = fsm_scalar(type, k, &offset);
        void *place = fsm_place_at(value, offset);
        switch (scalar->kind) {
        case FSM_FLOAT:
            fsm_set_float(scalar, place, read_float());
            break;
        case FSM_SYMBOL:
            fsm_set_bits(scalar, place, find_symbol(info, read_text()));
            break;
        case FSM_ENUMERATION:
            fsm_set_bits(scalar, place, (uint64_t)read_member(scalar));
            break;
        case FSM_BOOL:
            fsm_set_bits(scalar, place, read_bool());
            break;
        default:
            fsm_set_bits(scalar, place, (uint64_t)read_integer());
            break;
        }
    }
}

/* Keep the results of an operation that a line gives, in place of earlier ones. */
static void read_results(bool is_listed)
{
    results *found = malloc(sizeof *found);
    const unsigned long count = (unsigned long)read_integer();
    const size_t size = strlen(at) + 1u;
    char *text = malloc(size);
    if (found == NULL || text == NULL) {
        wrong("out of memory");
    }
    memcpy(text, at, size);
    *found = (results){all_results, count, 0, is_listed, text};
    all_results = found;
}

static void forget_results(void)
{
    while (all_results != NULL) {
        results *next = all_results->next;
        free(all_results->text);
        free(all_results);
        all_results = next;
    }
}

/* The next result of an operation; false if any value of its type may be. */
static bool next_result(const fsm_machine_info *info, const fsm_operation_info *operation, void *value)
{
    for (results *each = all_results; each != NULL; each = each->next) {
        unsigned long place;
        (void)snprintf(line, sizeof line, "%s", each->text);
        at = line;
        if (strcmp(read_text(), operation->name) != 0) {
            continue;
        }
        place = each->is_listed ? (next_random() >> 8) % each->count : each->at;
        for (unsigned long i = 0; i <= place; i++) {
            read_value(info, operation->result, value);
        }
        each->at += each->at + 1u < each->count;
        return true;
    }
    return false;
}

static void read_event(const fsm_machine_info *info, void *e)
{
    const char *name = read_text();
    memset(e, 0, info->event_size);
    for (uint32_t number = 1; number <= info->event_count; number++) {
        const fsm_event_info *event = &info->events[number - 1];
        if ((event->flags & FSM_EVENT_NAMED) == 0 || strcmp(name, event->name) != 0) {
            continue;
        }
        fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, number);
        for (unsigned i = 0; i < event->field_count; i++) {
            read_value(info, event->fields[i].type, fsm_place_at(e, event->fields[i].offset));
        }
        return;
    }
    wrong(name);
}

/* ---- what a machine does ----------------------------------------------------------------------- */

static void begun(const watched *of)
{
    if (pending[0] != 0) {
        fputs(pending, stdout);
        pending[0] = 0;
    }
    fputs(of->path, stdout);
}

static void hook_begin(const watched *of, const void *m, int cause, unsigned index)
{
    const uint32_t since = of->info->now;
    const uint32_t now = since == FSM_ABSENT ? of->now : *(const uint32_t *)fsm_at(m, since);
    if (cause != FSM_EVENTLESS) {
        begun(of);
    }
    if (cause == FSM_START) {
        printf("@%" PRIu32 " > start\n", now);
    } else if (cause == FSM_EVENT) {
        printf("@%" PRIu32 " > event ", now);
    } else if (cause == FSM_TIMEOUT) {
        printf("@%" PRIu32 " > timeout %u\n", now, index);
    } else {
        sprintf(pending, "@%" PRIu32 " > eventless\n", now);
    }
}

/* Whether the macrostep was one. */
static bool hook_end(const watched *of)
{
    if (pending[0] != 0) {
        pending[0] = 0;
        return false;
    }
    begun(of);
    printf("=");
    return true;
}

static void hook_event(const watched *of, int what, const void *e)
{
    static const char *const verbs[] = {"raise", "send", "delay", "out", "unhandled"};
    if (what == FSM_TAKEN) { /* goes on with the line of its macrostep */
        show_event(of->info, e);
        printf("\n");
        return;
    }
    begun(of);
    printf("%s ", verbs[what]);
    if (what == FSM_UNHANDLED) {
        printf("%s", of->info->events[fsm_event_of(of->info, e) - 1].name);
    } else {
        show_event(of->info, e);
    }
    if (what != FSM_DELAYED && what != FSM_LEFT) {
        printf("\n");
    }
}

static void hook_text(const watched *of, int what, const char *text, unsigned long number)
{
    if (what != FSM_DELAYED && what != FSM_LEFT) { /* these go on with a line */
        begun(of);
    }
    switch (what) {
    case FSM_DELAYED: printf(" in %lu\n", number); break;
    case FSM_LEFT:
        if (number != 0) {
            printf(" to %s", symbol_text(of->info, (uint32_t)number));
        }
        printf("\n");
        break;
    case FSM_ERROR: printf("error %s\n", text); break;
    case FSM_FULL: printf("full %s\n", text); break;
    case FSM_FAULT: printf("fault %s\n", text); break;
    case FSM_CANCELLED: printf("cancel %s\n", text); break;
    case FSM_LOG: printf("log %s", text); break;
    case FSM_REPLY: printf("reply"); break;
    default: break;
    }
}

static void hook_symbol(const watched *of, long symbol)
{
    if (symbol < 0) {
        show_bracket(symbol == -1);
    } else {
        show_text(symbol_text(of->info, (uint32_t)symbol));
    }
}

static void fsm_host_call(const watched *of, uint32_t number, const void *const *given, void *result)
{
    const fsm_operation_info *operation = &of->info->operations[number];
    if (within.calls > 0 && --within.calls == 0) {
        const bool fits = within.driver->post(within.machine, within.event);
        begun(within.of);
        printf(fits ? "post " : "reject ");
        show_event(within.of->info, within.event);
        printf("\n");
    }
    begun(of);
    printf("op %s", operation->name);
    for (unsigned i = 0; i < operation->parameter_count; i++) {
        show(of->info, operation->parameters[i].type, given[i]);
    }
    if (operation->result != NULL) {
        if (!next_result(of->info, operation, result)) {
            make(operation->result, result);
        }
        printf(" =");
        show(of->info, operation->result, result);
    }
    printf("\n");
}

/* ---- scripts ----------------------------------------------------------------------------------- */

/* The data of a machine, and of those that run in its slots. */
static void dump(const watched *of, const void *m)
{
    const fsm_machine_info *info = of->info;
    for (unsigned i = 0; i < (unsigned)info->data_count + info->output_count; i++) {
        begun(of);
        printf("d %s", info->variables[i].name);
        show(info, info->variables[i].type, fsm_at(m, info->variables[i].offset));
        printf("\n");
    }
    for (unsigned i = 0; i < info->slot_count; i += 1u + info->slots[i].within) {
        const fsm_slot *slot = &info->slots[i];
        char path[HARNESS_PATH];
        const watched inner = {slot->info, path, 0};
        snprintf(path, sizeof path, "%s%s: ", of->path, slot->name);
        if (fsm_is_running(slot->info, fsm_at(m, slot->offset))) {
            dump(&inner, fsm_at(m, slot->offset));
        }
    }
}

static void show_reply(const fsm_machine_info *info, const void *m, const void *e)
{
    const fsm_type *type = info->events[fsm_event_of(info, e) - 1].reply;
    double value = 0.0;
    uint64_t bits = 0;
    bool is_negative = false;
    if (type == NULL) {
        return;
    }
    if (info->reply != FSM_ABSENT) {
        const void *place = fsm_at(m, info->reply);
        if (info->reply_type->kind == FSM_FLOAT) {
            value = fsm_float_at(info->reply_type, place);
            is_negative = value < 0;
            bits = is_negative ? (uint64_t)(int64_t)value : (uint64_t)value;
        } else {
            bits = fsm_bits_at(info->reply_type, place);
            is_negative = fsm_is_signed(info->reply_type) && bits >> 63 != 0;
            value = is_negative ? (double)(int64_t)bits : (double)bits;
        }
    }
    if (type->kind == FSM_FLOAT) {
        show_float(value);
    } else if (type->kind == FSM_SYMBOL) {
        show_text(symbol_text(info, (uint32_t)bits));
    } else {
        show_integer(is_negative, bits);
    }
}

static void read_input(const fsm_machine_info *info, void *m)
{
    const char *name = read_text();
    const fsm_field *inputs = info->variables + info->data_count + info->output_count;
    for (unsigned i = 0; i < info->input_count; i++) {
        if (strcmp(name, inputs[i].name) == 0) {
            read_value(info, inputs[i].type, fsm_place_at(m, inputs[i].offset));
        }
    }
}

/* Take the bytes in hexadecimal that a line may name, in place of those that were saved last. */
static void read_saved(uint8_t *bytes, size_t size)
{
    const char *text = read_text();
    for (size_t i = 0; i < size && isxdigit((unsigned char)text[0]); i++, text += 2) {
        const char digits[3] = {text[0], text[1], 0};
        bytes[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
}

static void save(const fsm_driver *driver, const void *m, uint32_t now, uint8_t *bytes, size_t size)
{
    if (!driver->save(m, now, bytes)) {
        printf("not saved\n");
    }
    printf("saved ");
    for (size_t i = 0; i < size; i++) {
        printf("%02x", bytes[i]);
    }
    printf("\n");
}

void play_script(watched *of, const fsm_driver *driver, void *m, void *e, void *posted,
                 uint8_t *saved, size_t size)
{
    static const char *const answers[] = {"ignored", "handled", "busy", "stopped"};
    const fsm_machine_info *info = driver->info;
    info->init(m);
    while (next_line()) {
        const char *verb = read_text();
        if (strcmp(verb, "start") == 0) {
            of->now = (uint32_t)read_integer();
            driver->start(m, of->now);
        } else if (strcmp(verb, "run") == 0) {
            of->now = (uint32_t)read_integer();
            driver->run(m, of->now);
        } else if (strcmp(verb, "post") == 0) {
            read_event(info, e);
            if (!driver->post(m, e)) {
                printf("full queue\n");
            }
        } else if (strcmp(verb, "dispatch") == 0) {
            read_event(info, e);
            (void)driver->dispatch(m, e, of->now);
        } else if (strcmp(verb, "ask") == 0) {
            read_event(info, e);
            const fsm_result result = driver->dispatch(m, e, of->now);
            printf("answer %s", answers[result]);
            if (result == FSM_IGNORED || result == FSM_HANDLED) {
                show_reply(info, m, e);
            }
            printf("\n");
        } else if (strcmp(verb, "save") == 0) {
            save(driver, m, of->now, saved, size);
        } else if (strcmp(verb, "restore") == 0) {
            of->now = (uint32_t)read_integer();
            read_saved(saved, size);
            memset(m, 0xA5, info->size);
            info->init(m);
            if (driver->restore(m, of->now, saved, size) != FSM_RESTORED) {
                printf("not restored\n");
            }
        } else if (strcmp(verb, "within") == 0) {
            within.calls = (unsigned long)read_integer();
            read_event(info, posted);
            within.of = of;
            within.driver = driver;
            within.machine = m;
            within.event = posted;
        } else if (strcmp(verb, "from") == 0 || strcmp(verb, "returns") == 0) {
            read_results(verb[0] == 'f');
        } else if (strcmp(verb, "seed") == 0) {
            seed_random((uint32_t)read_integer());
        } else if (strcmp(verb, "input") == 0) {
            read_input(info, m);
        } else if (strcmp(verb, "dump") == 0) {
            dump(of, m);
        } else {
            wrong(verb);
        }
    }
    printf("%%\n");
    pending[0] = 0;
    within.calls = 0;
    forget_results();
    made_count = 0;
    random_state = 1;
    after_bracket = false;
}
