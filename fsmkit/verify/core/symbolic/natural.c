#include "symbolic/natural.h"

#include <stdlib.h>
#include <string.h>

void fsm_natural_add(uint32_t *sum, size_t sum_width, const uint32_t *added, size_t width, uint32_t times)
{
    uint64_t carry = 0;
    size_t i = 0;
    if (times == 1) /* most often */
        for (; i < width && i < sum_width; i++) {
            carry += (uint64_t)sum[i] + added[i];
            sum[i] = (uint32_t)carry;
            carry >>= 32;
        }
    for (; i < width && i < sum_width; i++) {
        carry += sum[i] + (uint64_t)added[i] * times;
        sum[i] = (uint32_t)carry;
        carry >>= 32;
    }
    for (; i < sum_width && carry != 0; i++) {
        carry += sum[i];
        sum[i] = (uint32_t)carry;
        carry >>= 32;
    }
}

void fsm_natural_subtract(uint32_t *from, size_t from_width, const uint32_t *taken, size_t width)
{
    uint64_t borrow = 0;
    for (size_t i = 0; i < from_width && (i < width || borrow != 0); i++) {
        uint64_t wanted = (i < width ? taken[i] : 0) + borrow;
        borrow = from[i] < wanted;
        from[i] = (uint32_t)(from[i] - wanted);
    }
}

bool fsm_natural_is_zero(const uint32_t *number, size_t width)
{
    for (size_t i = 0; i < width; i++)
        if (number[i] != 0)
            return false;
    return true;
}

/* Divides by a small number, and returns the rest. */
static uint32_t divide(uint32_t *number, size_t width, uint32_t by)
{
    uint64_t rest = 0;
    for (size_t i = width; i-- > 0;) {
        rest = rest << 32 | number[i];
        number[i] = (uint32_t)(rest / by);
        rest %= by;
    }
    return (uint32_t)rest;
}

char *fsm_natural_text(uint32_t *number, size_t width)
{
    enum { AT_ONCE = 9, BILLION = 1000000000 };
    while (width > 0 && number[width - 1] == 0)
        width--;
    size_t room = 10 * width + AT_ONCE + 2, at = room; /* ten decimal digits hold each of ours */
    char *text = malloc(room);
    if (text == NULL)
        return NULL;
    text[--at] = '\0';
    do {
        uint32_t rest = divide(number, width, BILLION);
        while (width > 0 && number[width - 1] == 0)
            width--;
        for (int i = 0; i < AT_ONCE && (width > 0 || rest > 0); i++, rest /= 10)
            text[--at] = (char)('0' + rest % 10);
    } while (width > 0);
    if (text[at] == '\0')
        text[--at] = '0';
    memmove(text, text + at, room - at);
    return text;
}
