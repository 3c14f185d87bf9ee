/* natural.h: natural numbers of any size, for counts of states. A number is an array of digits of 32 bits, the lowest
 * first, of a width that whoever uses it knows to be enough. */
#ifndef FSM_NATURAL_H
#define FSM_NATURAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* sum += added * times, of these widths, the sum's being at least the other one. What does not fit is lost. */
void fsm_natural_add(uint32_t *sum, size_t sum_width, const uint32_t *added, size_t width, uint32_t times);

/* from -= taken, which is not more. */
void fsm_natural_subtract(uint32_t *from, size_t from_width, const uint32_t *taken, size_t width);

bool fsm_natural_is_zero(const uint32_t *number, size_t width);

/* Decimal digits, to be freed; NULL if memory ran out. The number is lost. */
char *fsm_natural_text(uint32_t *number, size_t width);

#endif
