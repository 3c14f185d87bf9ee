/* harness.h: reading script lines and writing trace lines; see harness.c. */
#ifndef HARNESS_H
#define HARNESS_H

#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

extern char pending[64]; /* the first line of a macrostep that may turn out to be none */

uint32_t next_random(void);
void seed_random(uint32_t seed);

bool next_line(void); /* false at the end of the script */
void end_script(void); /* end the trace too; all is as in the beginning */
const char *read_text(void);
int64_t read_integer(void);
double read_float(void);
bool read_bool(void);
unsigned read_member(const char *const *members, unsigned count);
void wrong(const char *what);

/* Symbols that the machine does not know but a script or a host names. */
const char *made_symbol(long symbol);
uint16_t find_symbol(const char *(*known)(uint32_t), unsigned count, const char *text);

void show_integer(bool negative, uint64_t value);
void show_float(double value);
void show_text(const char *text);
void show_bracket(bool opening);

#endif
