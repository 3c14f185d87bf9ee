/* harness.c: reading script lines and writing trace lines. */
#include "harness.h"

#include <stdlib.h>

enum { LONGEST = 65536, MADE = 256 };

char pending[64];
static char line[LONGEST];
static char *at = line;
static char made[MADE][256];
static unsigned made_count;
static uint32_t random_state = 1;
static bool after_bracket;

uint32_t next_random(void)
{
    random_state = (1103515245u * random_state + 12345u) & 0x7fffffffu;
    return random_state;
}

void seed_random(uint32_t seed)
{
    random_state = seed;
}

void wrong(const char *what)
{
    fprintf(stderr, "wrong script line: %s\n", what);
    exit(2);
}

bool next_line(void)
{
    at = line;
    return fgets(line, sizeof line, stdin) != NULL && line[0] != '%';
}

void end_script(void)
{
    printf("%%\n");
    pending[0] = 0;
    made_count = 0;
    random_state = 1;
    after_bracket = false;
}

const char *read_text(void)
{
    char *word;
    while (*at != 0 && strchr(" [],", *at) != NULL) /* brackets tell nothing that types do not */
        at++;
    if (*at == '"') {
        word = ++at;
        while (*at != '"' && *at != 0)
            at++;
    } else {
        word = at;
        while (*at != 0 && strchr(" [],\n", *at) == NULL)
            at++;
    }
    if (*at != 0)
        *at++ = 0;
    return word;
}

int64_t read_integer(void)
{
    const char *text = read_text();
    return text[0] == '-' ? strtoll(text, NULL, 10) : (int64_t)strtoull(text, NULL, 10);
}

double read_float(void)
{
    return strtod(read_text(), NULL);
}

bool read_bool(void)
{
    const char *text = read_text();
    return strncmp(text, "1", 1) == 0 || strncmp(text, "true", 4) == 0;
}

unsigned read_member(const char *const *members, unsigned count)
{
    const char *text = read_text();
    for (unsigned i = 0; i < count; i++)
        if (strcmp(members[i], text) == 0)
            return i;
    return (unsigned)strtoul(text, NULL, 10);
}

const char *made_symbol(long symbol)
{
    return symbol >= 65536 - MADE ? made[65535 - symbol] : NULL;
}

uint16_t find_symbol(const char *(*known)(uint32_t), unsigned count, const char *text)
{
    for (unsigned i = 0; i < count; i++)
        if (strcmp(known(i), text) == 0)
            return (uint16_t)i;
    for (unsigned i = 0; i < made_count; i++)
        if (strcmp(made[i], text) == 0)
            return (uint16_t)(65535u - i);
    if (made_count == MADE)
        wrong("too many symbols");
    snprintf(made[made_count], sizeof made[0], "%s", text);
    return (uint16_t)(65535u - made_count++);
}

static void space(void)
{
    if (!after_bracket)
        putchar(' ');
    after_bracket = false;
}

void show_integer(bool negative, uint64_t value)
{
    space();
    if (negative)
        printf("%" PRId64, (int64_t)value);
    else
        printf("%" PRIu64, value);
}

void show_float(double value)
{
    space();
    if (value != value)
        printf("nan");
    else
        printf("%.17g", value);
}

void show_text(const char *text)
{
    space();
    printf("\"%s\"", text);
}

void show_bracket(bool opening)
{
    if (opening)
        space();
    putchar(opening ? '[' : ']');
    after_bracket = opening;
}
