#include "text.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void text_add(text *self, const char *format, ...)
{
    const size_t left = self->room - self->length;
    va_list arguments;
    int added;
    va_start(arguments, format);
    added = vsnprintf(self->at + self->length, left, format, arguments);
    va_end(arguments);
    if (added < 0 || (size_t)added >= left) {
        self->is_full = true;
        self->length = self->room - 1u;
    } else {
        self->length += (size_t)added;
    }
}

void text_add_string(text *self, const char *string)
{
    text_add(self, "\"");
    for (; *string != '\0'; string++) {
        const unsigned char c = (unsigned char)*string;
        if (c == '"' || c == '\\')
            text_add(self, "\\%c", c);
        else if (c < 0x20u)
            text_add(self, "\\u%04x", c);
        else
            text_add(self, "%c", c);
    }
    text_add(self, "\"");
}

/* Where the value of a member begins, past blanks; NULL if there is none. */
static const char *value_of(const char *json, const char *member)
{
    char quoted[64];
    const char *at;
    if ((size_t)snprintf(quoted, sizeof quoted, "\"%s\"", member) >= sizeof quoted)
        return NULL;
    at = strstr(json, quoted);
    if (at == NULL)
        return NULL;
    at += strlen(quoted);
    at += strspn(at, " \t\r\n");
    if (*at != ':')
        return NULL;
    at++;
    return at + strspn(at, " \t\r\n");
}

bool text_string_of(const char *json, const char *member, char *string, size_t room)
{
    const char *at = value_of(json, member);
    size_t length;
    if (at == NULL || *at != '"')
        return false;
    at++;
    length = strcspn(at, "\"\\");
    if (at[length] != '"' || length >= room)
        return false;
    memcpy(string, at, length);
    string[length] = '\0';
    return true;
}

bool text_number_of(const char *json, const char *member, double *number)
{
    const char *const at = value_of(json, member);
    char *end;
    if (at == NULL || strchr("+-.0123456789", *at) == NULL || *at == '\0')
        return false;
    *number = strtod(at, &end);
    return end != at;
}
