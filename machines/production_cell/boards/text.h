/* text.h: JSON to write, and the little of it that is read. */
#ifndef TEXT_H
#define TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* Text that grows within its room; what does not fit is cut off, and `is_full` says so. */
typedef struct {
    char *at;
    size_t room, length;
    bool is_full;
} text;

void text_add(text *self, const char *format, ...);

/* A string in quotes, with what JSON wants escaped. */
void text_add_string(text *self, const char *string);

/* The value of a member of a flat JSON object, as a string or a number; false if it is not there, is
 * none, or does not fit. */
bool text_string_of(const char *json, const char *member, char *string, size_t room);
bool text_number_of(const char *json, const char *member, double *number);

#endif
